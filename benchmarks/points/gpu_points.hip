#include "gpu_points.h"

#include "point_variants.h"

#include <hip/hip_runtime.h>
#include <hiprt_build/gpu/gpu.h>

namespace hiprt::bench {
namespace {

/// Neighbouring threads have points in the caller's order.
template <PointVariant kVariant>
__global__ void ask_points(SceneView scene, const Vec3* points, double* results, unsigned count, float reach) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = ask<kVariant>(scene, points[i], reach);
}

using Kernel = void (*)(SceneView, const Vec3*, double*, unsigned, float);

template <unsigned kVariant = 0> Kernel kernel_of(unsigned variant) {
  constexpr auto kThis = static_cast<PointVariant>(kVariant);
  if constexpr (kThis == PointVariant::kCount)
    return nullptr;
  else
    return variant == kVariant ? &ask_points<kThis> : kernel_of<kVariant + 1>(variant);
}

/// A pair of events, destroyed with it.
class Watch {
 public:
  Watch() = default;
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  ~Watch() {
    for (const hipEvent_t event : events_)
      if (event != nullptr) static_cast<void>(hipEventDestroy(event));
  }
  gpu::Result<void> open() {
    for (hipEvent_t& event : events_)
      if (auto made = gpu::check(hipEventCreate(&event), "hipEventCreate"); !made) return made;
    return {};
  }
  gpu::Result<void> mark(unsigned which) {
    return gpu::check(hipEventRecord(events_[which], nullptr), "hipEventRecord");
  }
  gpu::Result<double> seconds() {
    if (auto waited = gpu::check(hipEventSynchronize(events_[1]), "hipEventSynchronize"); !waited)
      return tl::unexpected(waited.error());
    float milliseconds = 0.0f;
    if (auto read = gpu::check(hipEventElapsedTime(&milliseconds, events_[0], events_[1]), "hipEventElapsedTime");
        !read)
      return tl::unexpected(read.error());
    return 1e-3 * static_cast<double>(milliseconds);
  }

 private:
  hipEvent_t events_[2] = {};
};

}  // namespace

build::Result<std::string> gpu_name() {
  const auto device = gpu::current_device();
  if (!device) return tl::unexpected(device.error());
  return device->name + ", " + device->architecture;
}

build::Result<GpuPointRun> ask_gpu(std::span<const std::byte> file, std::span<const Vec3> points, unsigned variant,
                                   float reach, unsigned rounds) {
  const hipStream_t stream = nullptr;
  gpu::DeviceAllocator allocator;
  const auto scene = gpu::upload_scene(file, stream, allocator);
  if (!scene) return tl::unexpected(scene.error());
  const auto device_points = gpu::DeviceArray<Vec3>::from(points, stream, allocator);
  if (!device_points) return tl::unexpected(device_points.error());
  auto results = gpu::DeviceArray<double>::make(points.size(), stream, allocator);
  if (!results) return tl::unexpected(results.error());
  Watch watch;
  if (auto opened = watch.open(); !opened) return tl::unexpected(opened.error());
  const auto count = static_cast<unsigned>(points.size());
  GpuPointRun run;
  // The first round warms up.
  for (unsigned round = 0; round <= rounds; ++round) {
    auto done = watch.mark(0);
    if (done)
      done = gpu::launch(kernel_of(variant), count, stream, {}, scene->view, device_points->data(), results->data(),
                         count, reach);
    if (done) done = watch.mark(1);
    if (!done) return tl::unexpected(done.error());
    const auto seconds = watch.seconds();
    if (!seconds) return tl::unexpected(seconds.error());
    if (round != 0) run.seconds.push_back(*seconds);
  }
  auto all = results->to_vector(stream);
  if (!all) return tl::unexpected(all.error());
  run.results = std::move(*all);
  return run;
}

}  // namespace hiprt::bench
