// Instances and motion at the extremes: closed meshes do not leak, whatever is between them and the scene; rays and
// times of any bits.

#include <hiprt_device/exact_triangle_test.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/moving_scenes.h>
#include <tests/traversal/workers.h>

#include <bit>
#include <cstdio>
#include <limits>
#include <numbers>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261124;
constexpr double kDegree = std::numbers::pi / 180;

struct Exact : Policies<PlanesLayout, Reference> {};
template <unsigned kLevels> using Still = Instanced<Policies<PlanesLayout>, kLevels>;
template <unsigned kLevels> using StillExact = Instanced<Exact, kLevels>;
using Moved = Moving<Instanced<Policies<PlanesLayout>, 2>>;
using MovedExact = Moving<Instanced<Exact, 2>>;

/// A mesh below one instance after the other.
struct Chain : InstanceScene {
  build::Motion motion{};

  Chain(const Mesh& mesh, const std::vector<Affine>& inwards) {
    add_file({mesh}, NodeLayout::kPlanes);
    for (std::size_t i = inwards.size(); i-- > 0;)
      groups.push_back({Instance{.object = static_cast<std::uint32_t>(groups.size()), .to_scene = inwards[i]}});
  }
  /// The outermost instance moves.
  Chain(const Mesh& mesh, const std::vector<Affine>& inwards, const build::Motion& way) : Chain(mesh, inwards) {
    motion = way;
    groups.back()[0].motion = &motion;
  }
};

/// A point of the mesh, where the scene has it at a time.
template <unsigned kLevels> Vec3D out_of(const SceneView& view, unsigned levels, float time, const Double3& point) {
  InstancePath<kLevels> path;
  path.depth = levels;
  std::vector<InstanceRecord> records;
  follow(view, path, time,
         [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) { records.push_back(record); });
  Vec3D p(point[0], point[1], point[2]);
  while (!records.empty()) {
    p = point_to_scene(records.back(), p);
    records.pop_back();
  }
  return p;
}

/// Rays from inside at edges, vertices and insides of the mesh.
template <class P> void check_no_leak(const std::string& name, const Closed& closed, const InstanceScene& scene) {
  const SceneView view = scene.view();
  REQUIRE(covers<P>(view));
  Random random(kSeed);
  const auto levels = static_cast<unsigned>(scene.groups.size());
  for (unsigned i = 0; i < trials(1500); ++i) {
    const Double3 center = closed.centers[i % closed.centers.size()], target = target_point(closed.mesh, random);
    const Double3 aside = random.on_sphere();
    Double3 start;
    for (std::size_t k = 0; k < 3; ++k) start[k] = center[k] + 0.5 * closed.room * aside[k];
    Ray ray;
    ray.time = random.uniform_float(-1, 2);
    ray.origin = Vec3(out_of<P::kLevels>(view, levels, ray.time, start));
    ray.direction = Vec3(out_of<P::kLevels>(view, levels, ray.time, target) - Vec3D(ray.origin));
    INFO(name << ", " << closed.name << ", ray " << i << " of seed " << kSeed);
    const auto hit = closest_hit<P>(view, ray);
    REQUIRE(hit.found());
    REQUIRE(hit.path.depth == levels);
    REQUIRE(any_hit<P>(view, ray).found());
    REQUIRE(hit.error < std::numeric_limits<float>::infinity());
  }
}

std::vector<Closed> shapes() {
  std::vector<Closed> result = closed_meshes();
  std::erase_if(result, [](const Closed& closed) { return closed.mesh.triangles.size() > 4000; });
  return result;
}

Affine sheared(float by) { return {{{1, by, 0, 2}, {0, 1, 0, -1}, {0, 0, 1, 3}}}; }

/// Any 32 bits, or what a ray may well have.
float any_bits(Random& random, double scale) {
  if (random.below(3) == 0) return std::bit_cast<float>(random.below(0xffffffffu));
  return random.uniform_float(-scale, scale);
}

template <class P> unsigned trace_any_bits(const SceneView& view, unsigned rays) {
  REQUIRE(covers<P>(view));
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < rays; ++i) {
    Ray ray;
    const bool wild = i % 2 == 0;
    for (int k = 0; k < 3; ++k) {
      ray.origin[k] = wild ? any_bits(random, 6) : random.uniform_float(-6, 6);
      ray.direction[k] = wild ? any_bits(random, 6) : -ray.origin[k] + random.uniform_float(-1, 1);
    }
    ray.tmin = random.below(4) == 0 ? any_bits(random, 1) : 0.0f;
    ray.tmax = random.below(4) == 0 ? any_bits(random, 2) : std::numeric_limits<float>::infinity();
    ray.time = any_bits(random, 3);
    INFO("ray " << i << " of seed " << kSeed);
    const auto hit = closest_hit<P>(view, ray);
    REQUIRE_FALSE(hit.failed());
    any_hit<P>(view, ray);
    if (!hit.found()) continue;
    ++hits;
    REQUIRE(std::isfinite(hit.t));
    REQUIRE(hit.t >= ray.tmin);
    REQUIRE(hit.t >= 0.0f);
    REQUIRE(hit.t <= ray.tmax);
    REQUIRE(std::isfinite(hit.u));
    REQUIRE(std::isfinite(hit.v));
    REQUIRE_FALSE(std::isnan(hit.error));
    for (int k = 0; k < 3; ++k) REQUIRE_FALSE(std::isnan(hit.normal[k]));
  }
  return hits;
}

}  // namespace

TEST_CASE("stretches of matrices are good far down, whatever the compiler", "[extremes]") {
  // diag(a, b, c) sheared: the product of the singular values is the determinant, the sum of their squares that of all
  // elements'.
  Random random(kSeed);
  for (unsigned i = 0; i < trials(3000); ++i) {
    const double shear = random.log_uniform(1e-3, 1e3), small = random.log_uniform(1e-5, 1);
    const double plane[3][3] = {{1, shear, 0}, {0, 1, 0}, {0, 0, small}};
    const Stretches stretches(plane);
    // Of the 2 x 2 block.
    const double sum = 2 + shear * shear, root = std::sqrt(sum * sum - 4);
    const double long_one = std::sqrt((sum + root) / 2), short_one = 1 / long_one;
    INFO("shear " << shear << ", " << small << " of seed " << kSeed);
    REQUIRE(stretches.longest == Approx(std::max(long_one, small)).epsilon(1e-13).margin(0));
    REQUIRE(stretches.shortest == Approx(std::min(short_one, small)).epsilon(1e-9).margin(0));
  }
}

TEST_CASE("closed meshes in instances do not leak: flat, tiny, sheared, mirrored, through 16 levels", "[extremes]") {
  Random random(kSeed);
  struct Case {
    std::string name;
    std::vector<Affine> inwards;
  };
  std::vector<Case> cases{{"scale 1e-13", {affine({0, 0.6, 0.8}, 1, {1e-13, 1e-13, 1e-13}, {0, 0, 0})}},
                          {"scale 1e13", {affine({0, 0.6, 0.8}, 1, {1e13, 1e13, 1e13}, {0, 0, 0})}},
                          {"flat to 1e-6", {affine({0.6, 0, 0.8}, 2, {1, 1, 1e-6}, {0, 0, 0})}},
                          {"a rod of 1e4", {affine({0.6, 0, 0.8}, 2, {1, 1, 1e4}, {3, 2, 1})}},
                          {"sheared by 1000", {sheared(1000)}},
                          {"mirrored", {affine({1, 0, 0}, 0.3, {-1, 1, 1}, {0, 5, 0})}},
                          {"1e5 away", {affine({1, 0, 0}, 0.3, {2, 1, 1}, {1e5, -3e4, 7e4})}}};
  for (const unsigned levels : {3u, 16u}) {
    Case chain{std::to_string(levels) + " levels", {}};
    for (unsigned i = 0; i < levels; ++i) chain.inwards.push_back(random_affine(random, 4));
    cases.push_back(chain);
  }
  const std::vector<Closed> closed = shapes();
  for (std::size_t i = 0; i < cases.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      const Closed& shape = closed[(i + k) % closed.size()];
      Chain scene(shape.mesh, cases[i].inwards);
      scene.build();
      check_no_leak<Still<kMostLevels>>(cases[i].name, shape, scene);
      check_no_leak<StillExact<kMostLevels>>(cases[i].name + ", exact", shape, scene);
    }
}

TEST_CASE("closed meshes that move do not leak at any time: turns to 180 degrees, tiny turns, matrices", "[extremes]") {
  Random random(kSeed + 1);
  const std::vector<Closed> closed = shapes();
  std::vector<std::pair<std::string, build::Motion>> motions;
  for (const double degrees : {1e-5, 1.0, 90.0, 179.9, 180.0})
    for (const MotionKind kind : {MotionKind::kSlerp, MotionKind::kNlerp})
      motions.push_back(
          {std::to_string(degrees) + " degrees",
           {.keys = {turned_key(0, {0.6, 0, 0.8}, 0), turned_key(1, {0.6, 0, 0.8}, degrees * kDegree, {2, -1, 3})},
            .kind = kind}});
  for (const MotionKind kind : {MotionKind::kSlerp, MotionKind::kMatrix}) {
    build::Motion motion = random_motion(random, kind, 4, 3);
    if (kind == MotionKind::kMatrix) {
      for (const build::MotionKey& key : motion.keys) motion.matrices.push_back(build::compose(key));
      motion.keys.clear();
    }
    motions.push_back({"any", motion});
  }
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const Closed& shape = closed[i % closed.size()];
    Chain scene(shape.mesh, {Affine{}, affine({0, 0, 1}, 0.7, {1, 2, 0.5}, {0.5, 0, 0})}, motions[i].second);
    scene.build();
    check_no_leak<Moved>(motions[i].first, shape, scene);
    check_no_leak<MovedExact>(motions[i].first + ", exact", shape, scene);
    // And the trees hide nothing.
    Chain ball(icosphere(3), {Affine{}, affine({0, 0, 1}, 0.7, {3, 4, 2}, {0.5, 0, 0})}, motions[i].second);
    ball.build();
    check_rays<Moved>(ball, kSeed + i, trials(400));
    check_rays<MovedExact>(ball, kSeed + i, trials(400));
  }
}

TEST_CASE("rays and times of any bits give sane answers in instances and motion", "[extremes]") {
  Random random(kSeed + 2);
  std::vector<Affine> inwards{random_affine(random, 1), random_affine(random, 1)};
  Chain still(icosphere(3), inwards);
  still.build();
  Chain moving(icosphere(3), inwards, random_motion(random, MotionKind::kSlerp, 3, 1));
  moving.build();
  const unsigned rays = trials(40000);
  unsigned hits = trace_any_bits<Still<2>>(still.view(), rays);
  hits += trace_any_bits<StillExact<2>>(still.view(), rays);
  hits += trace_any_bits<Moved>(moving.view(), rays);
  hits += trace_any_bits<MovedExact>(moving.view(), rays);
  std::printf("rays of any bits through instances: %u of %u hit\n", hits, 4 * rays);
  CHECK(hits > rays / 10);
}
