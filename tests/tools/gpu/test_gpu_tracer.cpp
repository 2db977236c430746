/// GpuTracer gives the results of trace(), bit for bit. Exceptions are the triangle test Fast and the box test Plain,
/// whose rounding depends on compiler and device.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <tests/gpu/random_scene.h>
#include <tools/base/interrupt.h>
#include <tools/cli/build/build_names.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <tests/catch.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdlib>

using namespace hiprt;
using namespace hiprt::tools;
using Catch::Contains;

namespace {

constexpr std::uint64_t kSeed = 71;

struct TestScene {
  build::Bvh bvh;
  BufferView view;
};

TestScene random_scene(NodeLayout layout) {
  auto bvh = build::build(oracle::views(checks::star_in_soup(kSeed)), {.nodes = layout});
  REQUIRE(bvh.has_value());
  TestScene scene{std::move(*bvh), {}};
  scene.view = *open_buffer(std::as_const(scene.bvh.buffer).bytes());
  return scene;
}

std::vector<Ray> random_rays(std::size_t count) {
  const checks::SceneSource scene{"soup", checks::star_in_soup(kSeed)};
  oracle::Random random(kSeed);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) ray = checks::random_ray(scene, random).ray;
  return rays;
}

GpuTracer gpu_tracer(const BufferView& view, const GpuTracerOptions& options = {}) {
  auto tracer = GpuTracer::make(view, options);
  INFO((tracer ? "" : tracer.error().message));
  REQUIRE(tracer.has_value());
  return std::move(*tracer);
}

/// Bits, so that NaN is equal to itself and 0 is not -0.
bool same(const Hit& a, const Hit& b) {
  using Words = std::array<std::uint32_t, sizeof(Hit) / 4>;
  return std::bit_cast<Words>(a) == std::bit_cast<Words>(b);
}

/// Hits of the same rays.
struct DeviceHits {
  std::vector<Hit> cpu, gpu;
};

DeviceHits trace_on_both(const TestScene& scene, Query query, const TracePolicies& policies) {
  const std::vector<Ray> rays = random_rays(4000);
  DeviceHits result{std::vector<Hit>(rays.size()), std::vector<Hit>(rays.size())};
  trace(make_scene_view(scene.view), query, policies, rays, result.cpu);
  GpuTracer tracer = gpu_tracer(scene.view);
  const auto seconds = tracer.trace(query, policies, rays, result.gpu);
  INFO((seconds ? "" : seconds.error().message));
  REQUIRE(seconds.has_value());
  return result;
}

/// Checks that the hits of all but @p allowed rays agree.
/// @return how many of the rays hit.
template <class Agree> std::size_t compare_by(const DeviceHits& hits, std::size_t allowed, Agree&& agree) {
  std::size_t different = 0, found = 0;
  for (std::size_t i = 0; i < hits.cpu.size(); ++i) {
    different += agree(hits.cpu[i], hits.gpu[i]) ? 0 : 1;
    found += hits.cpu[i].found() ? 1 : 0;
  }
  CHECK(different <= allowed);
  return found;
}

std::size_t compare(const TestScene& scene, Query query, const TracePolicies& policies, std::size_t allowed = 0) {
  return compare_by(trace_on_both(scene, query, policies), allowed, same);
}

/// Compares the primitives of closest hits, and t to a relative 1e-4.
std::size_t compare_distances(const TestScene& scene, const TracePolicies& policies, std::size_t allowed) {
  return compare_by(trace_on_both(scene, Query::kClosest, policies), allowed, [](const Hit& a, const Hit& b) {
    if (!a.found() || !b.found()) return a.found() == b.found();
    return a.geometry == b.geometry && a.primitive == b.primitive && std::abs(a.t - b.t) <= 1e-4f * a.t;
  });
}

}  // namespace

TEST_CASE("a GPU's hits are the CPU's in every layout, for closest and any hit") {
  for (const auto& [name, layout] : kLayouts) {
    CAPTURE(name);
    const TestScene scene = random_scene(layout);
    const std::size_t closest = compare(scene, Query::kClosest, {}), any = compare(scene, Query::kAny, {});
    CHECK(closest == any);
    CHECK(closest > 1000);
    CHECK(closest < 4000);
  }
}

TEST_CASE("a GPU's hits are nearly the CPU's with the fast triangle test and with plain boxes") {
  const TestScene scene = random_scene(NodeLayout::kFloat);
  // Its products and sums are contracted or not as the compiler likes: nearly the same hits, with other last bits.
  CHECK(compare_distances(scene, {TriangleTestKind::kFast, BoxTestKind::kConservative}, 40) > 1000);
  // What touches the edge of a plain box is found or not by the last bit of a reciprocal, which every device rounds in
  // its own way.
  CHECK(compare(scene, Query::kAny, {TriangleTestKind::kWatertight, BoxTestKind::kPlain}, 20) > 1000);
}

TEST_CASE("a GPU's exact decisions are the CPU's") {
  const TestScene scene = random_scene(NodeLayout::kPlanes);
  CHECK(compare(scene, Query::kClosest, {.triangle_test = TriangleTestKind::kReference}) > 1000);
  CHECK(compare(scene, Query::kAny, {.triangle_test = TriangleTestKind::kReference}) > 1000);
}

TEST_CASE("a batch in parts gives the hits of the batch, with progress; no rays are no work") {
  const TestScene scene = random_scene(NodeLayout::kPlanes);
  const std::vector<Ray> rays = random_rays(2500);
  std::vector<Hit> cpu(rays.size()), gpu(rays.size());
  trace(make_scene_view(scene.view), Query::kClosest, {}, rays, cpu);
  GpuTracer tracer = gpu_tracer(scene.view, {.rays_at_once = 1000});
  std::vector<double> done;
  REQUIRE(tracer.trace(Query::kClosest, {}, rays, gpu, [&](double part) { done.push_back(part); }).has_value());
  CHECK(done == std::vector<double>{0.4, 0.8, 1.0});
  CHECK(std::equal(cpu.begin(), cpu.end(), gpu.begin(), same));
  CHECK(tracer.trace(Query::kClosest, {}, {}, {}) == 0.0);
  CHECK_THAT(tracer.device_name(), Contains(std::getenv("HIPRT_TEST_GPU_ARCH")));
}

TEST_CASE("Ctrl-C ends a batch between its parts") {
  const TestScene scene = random_scene(NodeLayout::kPlanes);
  const std::vector<Ray> rays = random_rays(2500);
  std::vector<Hit> hits(rays.size());
  GpuTracer tracer = gpu_tracer(scene.view, {.rays_at_once = 1000});
  std::vector<double> before;
  {
    const InterruptGuard guard;
    const auto cancelled = tracer.trace(Query::kClosest, {}, rays, hits, [&](double part) {
      before.push_back(part);
      std::raise(SIGINT);
    });
    REQUIRE_FALSE(cancelled.has_value());
    CHECK(cancelled.error().code == build::ErrorCode::kCancelled);
    CHECK(before == std::vector<double>{0.4});
  }
  const InterruptGuard forgets;
  CHECK(tracer.trace(Query::kClosest, {}, rays, hits).has_value());
}

TEST_CASE("rays that overflow their stacks are an error with their number and the bound") {
  const TestScene scene = random_scene(NodeLayout::kFloat);
  // Like the bound of a file that was not validated. Private stacks have more entries than that and do not overflow.
  FileHeader header = *scene.view.header;
  header.stack_bound = 0;
  BufferView view = scene.view;
  view.header = &header;
  GpuTracer tracer = gpu_tracer(view);
  const std::vector<Ray> rays = random_rays(4000);
  std::vector<Hit> hits(rays.size());
  const auto refused = tracer.trace(Query::kAny, {}, rays, hits);
  if (std::string(std::getenv("HIPRT_TEST_GPU_ARCH")).starts_with("sm_")) {
    CHECK(refused.has_value());
    return;
  }
  REQUIRE_FALSE(refused.has_value());
  CHECK_THAT(refused.error().message,
             Catch::Matches("[1-9][0-9]* of 4000 rays needed more stack entries than the scene says, 0"));
}
