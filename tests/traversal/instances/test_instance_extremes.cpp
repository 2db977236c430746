// Extreme instances and motion: closed meshes do not leak with any transform between them and the scene. Rays and times
// have arbitrary bits.

#include <hiprt_device/intersect/exact_triangle_test.h>
#include <tests/traversal/instances/extreme_instances.h>
#include <tests/traversal/workers.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261124;

struct Exact : Policies {
  using Triangle = Reference;
};
template <unsigned kLevels> using Still = Instanced<Policies, kLevels>;
template <unsigned kLevels> using StillExact = Instanced<Exact, kLevels>;
using Moved = Moving<Instanced<Policies, 2>>;
using MovedExact = Moving<Instanced<Exact, 2>>;

/// Rays from inside at edges, vertices and insides of the mesh.
template <class P> void check_no_leak(const std::string& name, const Closed& closed, const Chain& scene) {
  const SceneView view = scene.view();
  REQUIRE(covers<P>(view));
  Random random(kSeed);
  for (unsigned i = 0; i < trials(1500); ++i) {
    const Ray ray = scene.ray_from_inside(closed, random);
    INFO(name << ", " << closed.name << ", ray " << i << " of seed " << kSeed);
    const auto hit = closest_hit<P>(view, ray);
    REQUIRE(hit.found());
    REQUIRE(hit.path.depth == scene.levels());
    REQUIRE(any_hit<P>(view, ray).found());
    REQUIRE(hit.error < std::numeric_limits<float>::infinity());
  }
}

template <class P> unsigned trace_any_bits(const SceneView& view, unsigned rays) {
  REQUIRE(covers<P>(view));
  Random random(kSeed);
  unsigned hits = 0;
  for (unsigned i = 0; i < rays; ++i) {
    const Ray ray = ray_of_any_bits(random);
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

TEST_CASE("stretches of ill-conditioned matrices are accurate, with every compiler", "[extremes]") {
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
  const std::vector<ExtremeChain> chains = still_extremes(random);
  const std::vector<Closed> closed = small_closed_meshes();
  for (std::size_t i = 0; i < chains.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      const Closed& shape = closed[(i + k) % closed.size()];
      const Chain scene(shape.mesh, chains[i]);
      check_no_leak<Still<kMostLevels>>(chains[i].name, shape, scene);
      check_no_leak<StillExact<kMostLevels>>(chains[i].name + ", exact", shape, scene);
    }
}

TEST_CASE("closed meshes that move do not leak at any time: turns to 180 degrees, tiny turns, matrices", "[extremes]") {
  Random random(kSeed + 1);
  const std::vector<Closed> closed = small_closed_meshes();
  const std::vector<ExtremeChain> chains = moving_extremes(random);
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const Closed& shape = closed[i % closed.size()];
    const Chain scene(shape.mesh, chains[i]);
    check_no_leak<Moved>(chains[i].name, shape, scene);
    check_no_leak<MovedExact>(chains[i].name + ", exact", shape, scene);
    // And the trees hide nothing.
    ExtremeChain larger = chains[i];
    larger.inwards.back() = affine({0, 0, 1}, 0.7, {3, 4, 2}, {0.5, 0, 0});
    const Chain ball(icosphere(3), larger);
    check_rays<Moved>(ball, kSeed + i, trials(400));
    check_rays<MovedExact>(ball, kSeed + i, trials(400));
  }
}

TEST_CASE("rays and times of any bits give valid results in instances and motion", "[extremes]") {
  Random random(kSeed + 2);
  ExtremeChain chain{"", {random_affine(random, 1), random_affine(random, 1)}};
  const Chain still(icosphere(3), chain);
  chain.motion = random_motion(random, MotionKind::kSlerp, 3, 1);
  const Chain moving(icosphere(3), chain);
  const unsigned rays = trials(40000);
  unsigned hits = trace_any_bits<Still<2>>(still.view(), rays);
  hits += trace_any_bits<StillExact<2>>(still.view(), rays);
  hits += trace_any_bits<Moved>(moving.view(), rays);
  hits += trace_any_bits<MovedExact>(moving.view(), rays);
  std::printf("rays of any bits through instances: %u of %u hit\n", hits, 4 * rays);
  CHECK(hits > rays / 10);
}
