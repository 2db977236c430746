// Deforming meshes: at every time the hits are those of the still mesh of that time.

#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/traversal/every_hit.h>

#include <hiprt_build/format/view.h>
#include <hiprt_device/primitives/moving_triangle.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Mesh;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261124;

/// A mesh at several times, as a program holds it.
struct Deforming {
  std::vector<Mesh> keys;
  std::vector<float> times, positions;
  std::vector<std::uint32_t> triangles;
  std::vector<Box> boxes;
  build::Buffer file;

  Deforming(std::vector<Mesh> of_keys, std::vector<float> of_times)
      : keys(std::move(of_keys)), times(std::move(of_times)) {
    for (const Mesh& key : keys)
      for (const auto& p : key.positions) positions.insert(positions.end(), p.begin(), p.end());
    for (const auto& t : keys[0].triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    for (std::uint32_t i = 0; i < keys[0].triangles.size(); ++i) boxes.push_back(set().bounds(i));
    const build::CustomGeometry geometry[1] = {{.boxes = boxes}};
    auto bvh = build::build(build::SceneInput{{}, geometry}, {.builder = build::Builder::kHploc});
    REQUIRE(bvh.has_value());
    file = std::move(bvh->buffer);
  }
  MovingTriangleSet set() const {
    return {{positions.data(), times.data(), triangles.data(), static_cast<std::uint32_t>(keys[0].positions.size()),
             static_cast<std::uint32_t>(keys.size())}};
  }
  /// As it is at a time, in floats.
  Mesh at(float time) const {
    std::size_t k = 0;
    while (k + 2 < keys.size() && times[k + 1] <= time) ++k;
    const std::size_t next = std::min(k + 1, keys.size() - 1);
    const float s = next == k || time <= times[k] ? 0.0f
                    : time >= times[next]         ? 1.0f
                                                  : (time - times[k]) / (times[next] - times[k]);
    Mesh mesh = keys[k];
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        mesh.positions[i][axis] = std::fma(s, keys[next].positions[i][axis], (1.0f - s) * keys[k].positions[i][axis]);
    return mesh;
  }
  Hit closest(const Ray& ray) const {
    using List = PrimitiveList<MovingTriangleSet>;
    using P = Policies;
    P::Stack::Memory memory;
    return ClosestHit<P, NoFilter, List>(make_scene_view(*open_buffer(file.bytes())), ray, P::Stack::Storage(memory),
                                         {}, List{set()})
        .next_hit();
  }
};

Deforming twisting_ball() {
  const Mesh ball = oracle::icosphere(3);
  return {{ball, oracle::twisted(ball, 0.2), oracle::shaken(ball, 0.3, kSeed)}, {-1.0f, 0.25f, 3.0f}};
}

Ray aimed_ray(Random& random) {
  Ray ray;
  const auto from = random.on_sphere();
  const auto at = random.in_cube(0.7);
  ray.origin = Vec3(4 * from[0], 4 * from[1], 4 * from[2]);
  ray.direction = Vec3(at[0], at[1], at[2]) - ray.origin;
  ray.time = random.below(6) == 0 ? -1.0f : random.uniform_float(-2, 4);
  return ray;
}

}  // namespace

namespace {

/// Rays at one time hit what deforms as they hit the mesh of that time, to the last bit. @return how many hit.
unsigned check_as_still(const Deforming& deforming, const Mesh& still_mesh, float time, unsigned rays, Random& random) {
  const std::vector<build::TriangleMesh> views{still_mesh.view()};
  const auto still = build::build(views);
  REQUIRE(still.has_value());
  const SceneView scene = make_scene_view(*open_buffer(still->buffer.bytes()));
  unsigned hits = 0;
  for (unsigned k = 0; k < rays; ++k) {
    Ray ray = aimed_ray(random);
    ray.time = time;
    INFO("time " << time << ", ray " << k);
    const Hit expected = closest_hit<Policies>(scene, ray), hit = deforming.closest(ray);
    REQUIRE(hit.found() == expected.found());
    if (!hit.found()) continue;
    ++hits;
    REQUIRE((hit.t == expected.t && hit.u == expected.u && hit.v == expected.v));
    REQUIRE((hit.primitive == expected.primitive && hit.normal == expected.normal));
    REQUIRE(hit.error >= expected.error);
    REQUIRE(hit.error < expected.error + 1e-6f);
  }
  return hits;
}

}  // namespace

TEST_CASE("a deforming mesh has the hits of the static mesh at that time, bit by bit") {
  INFO("seed " << kSeed);
  const Deforming deforming = twisting_ball();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 60; ++i) {
    const float time = aimed_ray(random).time;
    hits += check_as_still(deforming, deforming.at(time), time, 50, random);
  }
  CHECK(hits > 1000);
}

TEST_CASE("the error of a hit on what moves has four units of the largest coordinate more") {
  // 1 - s, the product and the sum round by 2^-24 each. The larger key counts, also where the ray uses the other one.
  Mesh small, large;
  small.positions = {{-4, -4, 0}, {4, -4, 0}, {0, 4, 0}};
  small.triangles = {{0, 1, 2}};
  large = small;
  for (auto& p : large.positions)
    for (float& x : p) x *= 2;
  const Deforming deforming({small, large}, {0, 1});
  const std::vector<build::TriangleMesh> views{small.view()};
  const auto still = build::build(views);
  REQUIRE(still.has_value());
  const Ray ray{.origin = {0, 0, 64}, .direction = {0, 0, -1}, .time = 0};
  const Hit expected = closest_hit<Policies>(make_scene_view(*open_buffer(still->buffer.bytes())), ray);
  const float more = deforming.closest(ray).error - expected.error;
  CHECK(more == 4 * 0x1p-24f * 8);
}

TEST_CASE("corners that are not finite: rays miss their triangles while a key has them, and hit the others") {
  // Builders drop non-finite triangles of a still mesh, so the mesh of that time has only triangles that can be hit.
  INFO("seed " << kSeed);
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  Random random(kSeed);
  for (const float bad : {kNan, -kNan, kInfinity, -kInfinity})
    for (std::size_t key = 0; key < 3; ++key) {
      const Deforming whole = twisting_ball();
      std::vector<Mesh> keys = whole.keys;
      std::vector<bool> broken(keys[0].positions.size());
      for (unsigned i = 0; i < 150; ++i) {
        const std::uint32_t vertex = random.below(static_cast<std::uint32_t>(broken.size()));
        keys[key].positions[vertex][random.below(3)] = bad;
        broken[vertex] = true;
      }
      const Deforming deforming(keys, whole.times);
      unsigned hits = 0, hits_of_broken_at_other_times = 0;
      for (const float time : {-2.0f, -1.0f, -0.5f, 0.2f, 0.25f, 0.5f, 2.9f, 3.0f, 4.0f}) {
        INFO("key " << key << ", " << bad);
        Mesh still = deforming.at(time);
        // With an infinite corner at any time the box is invalid, and the triangle is not in the tree.
        const bool in_segment = time < 0.25f ? key < 2 : key > 0;
        for (build::Triangle& triangle : still.triangles)
          if (std::isinf(bad) && (broken[triangle[0]] || broken[triangle[1]] || broken[triangle[2]]))
            triangle = {0, 0, 0};
        hits += check_as_still(deforming, still, time, 60, random);
        if (!std::isnan(bad) || in_segment) continue;
        hits_of_broken_at_other_times += check_as_still(deforming, still, time, 60, random);
      }
      CHECK(hits > 100);
      if (std::isnan(bad) && key != 1) CHECK(hits_of_broken_at_other_times > 50);
    }
}

TEST_CASE("times of rays: NaN gives a miss; infinite times give the first and the last key") {
  INFO("seed " << kSeed);
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  const Deforming deforming = twisting_ball();
  Random random(kSeed);
  CHECK(check_as_still(deforming, deforming.keys.front(), -kInfinity, 300, random) > 100);
  CHECK(check_as_still(deforming, deforming.keys.back(), kInfinity, 300, random) > 100);
  for (const float time : {kNan, -kNan}) CHECK(check_as_still(deforming, Mesh{}, time, 300, random) == 0);
}

TEST_CASE("times of keys that do not increase, or of any bits, give a miss or a finite hit") {
  INFO("seed " << kSeed);
  const Deforming whole = twisting_ball();
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < 40; ++i) {
    std::vector<float> times = whole.times;
    for (float& time : times)
      if (random.coin()) time = random.below(3) == 0 ? std::numeric_limits<float>::quiet_NaN() : random.any_float();
    const Deforming deforming(whole.keys, times);
    for (unsigned k = 0; k < 100; ++k) {
      Ray ray = aimed_ray(random);
      if (k % 8 == 0) ray.time = random.any_float();
      INFO("times " << i << ", ray " << k);
      const Hit hit = deforming.closest(ray);
      REQUIRE_FALSE(hit.failed());
      if (!hit.found()) continue;
      ++hits;
      REQUIRE((hit.t >= 0 && hit.t <= std::numeric_limits<float>::max()));
      REQUIRE((hit.u >= 0 && hit.u <= 1 && hit.v >= 0 && hit.v <= 1));
      REQUIRE(hit.error >= 0);
      for (int axis = 0; axis < 3; ++axis) REQUIRE(std::isfinite(hit.normal[axis]));
    }
  }
  CHECK(hits > 500);
}

TEST_CASE("deforming triangles stay within their boxes") {
  const Deforming deforming = twisting_ball();
  for (unsigned step = 0; step <= 400; ++step) {
    const Mesh mesh = deforming.at(-1.5f + 0.0125f * static_cast<float>(step));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      for (const auto vertex : mesh.triangles[i])
        for (std::size_t axis = 0; axis < 3; ++axis) {
          REQUIRE(deforming.boxes[i].min[axis] <= mesh.positions[vertex][axis]);
          REQUIRE(mesh.positions[vertex][axis] <= deforming.boxes[i].max[axis]);
        }
  }
}

TEST_CASE("no ray passes between deforming triangles, aimed at edges and corners") {
  const Deforming deforming = twisting_ball();
  Random random(kSeed);
  for (unsigned i = 0; i < 20000; ++i) {
    // Out of a closed surface, through a point of an edge as well as floats allow.
    const float time = random.uniform_float(-2, 4);
    const Mesh mesh = deforming.at(time);
    const auto& triangle = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
    const auto &a = mesh.positions[triangle[0]], &b = mesh.positions[triangle[1]];
    const float w = i % 4 == 0 ? 0.0f : random.uniform_float(0, 1);
    Ray ray;
    ray.direction = Vec3(a[0] + w * (b[0] - a[0]), a[1] + w * (b[1] - a[1]), a[2] + w * (b[2] - a[2]));
    ray.time = time;
    INFO("seed " << kSeed << ", ray " << i);
    REQUIRE(deforming.closest(ray).found());
  }
}

TEST_CASE("one key gives a static mesh, and a NaN time gives a miss") {
  const Deforming still(std::vector<Mesh>{oracle::icosphere(1)}, {5.0f});
  Ray ray{.origin = {0, 0, 3}, .direction = {0.01f, 0.02f, -1}};
  const float first = still.closest(ray).t;
  CHECK(first < 2.1f);
  ray.time = 100;
  CHECK(still.closest(ray).t == first);
  ray.time = std::numeric_limits<float>::quiet_NaN();
  CHECK(still.closest(ray).t == first);
  CHECK_FALSE(twisting_ball().closest(ray).found());
}
