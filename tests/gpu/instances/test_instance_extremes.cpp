// Extreme instances and motion on a GPU: hits equal the host's, bit for bit, and closed meshes do not leak. Rays and
// times with arbitrary bits give valid hits or misses.

#include <tests/gpu/instances/instance_extremes.h>

#include <hiprt_build/gpu/scene.h>
#include <tests/gpu/results.h>
#include <tests/traversal/instances/extreme_instances.h>

#include <array>
#include <cmath>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261125;

bool same_bits(const ExtremeInstanceHit& a, const ExtremeInstanceHit& b) {
  using Words = std::array<std::uint32_t, sizeof(ExtremeInstanceHit) / sizeof(std::uint32_t)>;
  return std::bit_cast<Words>(a) == std::bit_cast<Words>(b);
}

/// The device's hits, which must equal the host's.
std::vector<ExtremeInstanceHits> trace(const Chain& chain, std::span<const Ray> rays) {
  gpu::DeviceAllocator allocator;
  const auto scene = must(gpu::upload_scene(chain.file.bytes(), nullptr, allocator));
  auto found = must(trace_extreme_instances_on_device(scene.view, rays));
  const auto expected = trace_extreme_instances(chain.view(), rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    INFO("ray " << i);
    REQUIRE(same_bits(found[i].closest, expected[i].closest));
    REQUIRE(same_bits(found[i].reference, expected[i].reference));
    REQUIRE(same_bits(found[i].in_double, expected[i].in_double));
  }
  return found;
}

void check_no_leaks(const std::vector<ExtremeChain>& chains) {
  constexpr unsigned kRays = 128;
  const std::vector<Closed> closed = small_closed_meshes();
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const Closed& shape = closed[i % closed.size()];
    INFO(chains[i].name << ", " << shape.name << ", seed " << kSeed);
    const Chain chain(shape.mesh, chains[i]);
    Random random(kSeed + i);
    std::vector<Ray> rays;
    for (unsigned k = 0; k < kRays; ++k) rays.push_back(chain.ray_from_inside(shape, random));
    const std::vector<ExtremeInstanceHits> found = trace(chain, rays);
    for (std::size_t k = 0; k < kRays; ++k) {
      INFO("ray " << k);
      for (const ExtremeInstanceHit* hit : {&found[k].closest, &found[k].reference, &found[k].in_double}) {
        REQUIRE(hit->primitive != kInvalidId);
        REQUIRE(hit->depth == chain.levels());
        REQUIRE(hit->error < std::numeric_limits<float>::infinity());
      }
    }
  }
}

/// @return 1 for a hit.
unsigned judge_sane(const Ray& ray, const ExtremeInstanceHit& hit) {
  if (hit.primitive == kInvalidId) {
    REQUIRE(hit.t == std::numeric_limits<double>::infinity());
    return 0;
  }
  REQUIRE(std::isfinite(hit.t));
  REQUIRE(hit.t >= std::max(0.0f, ray.tmin));
  REQUIRE(hit.t <= ray.tmax);
  REQUIRE(std::isfinite(hit.u));
  REQUIRE(std::isfinite(hit.v));
  REQUIRE_FALSE(std::isnan(hit.error));
  REQUIRE_FALSE(std::isnan(hit.t_error));
  for (const double x : hit.normal) REQUIRE_FALSE(std::isnan(x));
  return 1;
}

}  // namespace

TEST_CASE("extreme instances: hits equal the host's bits, and no leaks") {
  Random random(kSeed);
  check_no_leaks(still_extremes(random));
}

TEST_CASE("extreme motion: hits equal the host's bits, and no leaks") {
  Random random(kSeed + 1);
  check_no_leaks(moving_extremes(random));
}

TEST_CASE("rays and times of any bits through instances and motion: valid results with the host's bits") {
  constexpr unsigned kRays = 2048;
  Random random(kSeed + 2);
  ExtremeChain chain{"still", {random_affine(random, 1), random_affine(random, 1)}};
  for (const bool moves : {false, true}) {
    if (moves) chain.motion = random_motion(random, MotionKind::kSlerp, 3, 1);
    const Chain scene(icosphere(3), chain);
    std::vector<Ray> rays;
    for (unsigned i = 0; i < kRays; ++i) rays.push_back(ray_of_any_bits(random));
    INFO((moves ? "moving" : "still") << ", seed " << kSeed);
    const std::vector<ExtremeInstanceHits> found = trace(scene, rays);
    unsigned hits = 0;
    for (std::size_t i = 0; i < kRays; ++i) {
      INFO("ray " << i);
      hits += judge_sane(rays[i], found[i].closest);
      hits += judge_sane(rays[i], found[i].reference);
      hits += judge_sane(rays[i], found[i].in_double);
    }
    CHECK(hits > kRays / 20);
  }
}
