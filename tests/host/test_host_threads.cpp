// The host's part of a scene on many threads.

#include <hiprt_build/trace_rays.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/host/soups.h>
#include <tests/traversal/tracers.h>

#include <tests/catch.h>

#include <thread>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 809;

}  // namespace

TEST_CASE("Many rays at once: too few hits are an error, threads share the blocks") {
  Random random(kSeed);
  const Scene scene = make_scene({soup(random, 500, 0.1)});
  std::vector<Ray> rays(10000);
  for (Ray& ray : rays) ray = random_ray(random, 1.0);
  std::vector<Hit> hits(rays.size()), threaded(rays.size());
  const auto refused = closest_hits(scene.traced, rays, std::span(hits).first(9999));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "closest_hits: 10000 rays, but room for 9999 hits");
  CHECK(any_hits(scene.traced, rays, {}).error().code == build::ErrorCode::kInvalidInput);
  const ParallelLoop loop = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < count; ++i) threads.emplace_back([&, i] { body(i); });
    for (std::thread& thread : threads) thread.join();
  };
  REQUIRE(closest_hits(scene.traced, rays, hits));
  REQUIRE(closest_hits(scene.traced, rays, threaded, loop));
  for (std::size_t i = 0; i < rays.size(); ++i) REQUIRE(same_hit(hits[i], threaded[i]));
}

TEST_CASE("Threads may ask for a scene at the same time") {
  Random random(kSeed + 1);
  const Mesh mesh = soup(random, 5000, 0.05);
  auto bvh = build::build(std::vector{mesh.view()});
  REQUIRE(bvh);
  std::vector<SceneView> views(8);
  std::vector<std::thread> threads;
  for (SceneView& view : views) threads.emplace_back([&] { view = bvh->scene(); });
  for (std::thread& thread : threads) thread.join();
  for (const SceneView& view : views) CHECK(view.host == views[0].host);
  build::Bvh moved = std::move(*bvh);
  CHECK(moved.scene().host == views[0].host);
}
