#include "device.h"

#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/gpu/scene.h>

#include <nlohmann/json.hpp>

#include <fstream>
#include <string>

namespace hiprt::bench {
namespace {

using gpu::check;

/// Version line of NVIDIA's driver; empty with other drivers.
std::string driver_text() {
  std::ifstream file("/proc/driver/nvidia/version");
  std::string line;
  std::getline(file, line);
  return line;
}

Memory share(gpu::DeviceBuffer&& buffer) {
  auto owner = std::make_shared<gpu::DeviceBuffer>(std::move(buffer));
  std::byte* data = owner->data();
  const std::size_t size = owner->size();
  return {std::move(owner), data, size};
}

class GpuDevice final : public Device {
 public:
  explicit GpuDevice(gpu::Device device) : device_(std::move(device)) {}

  nlohmann::json describe() const override {
    int driver = 0, runtime = 0;
    static_cast<void>(hipDriverGetVersion(&driver));
    static_cast<void>(hipRuntimeGetVersion(&runtime));
    return {{"kind", "gpu"},
            {"name", device_.name},
            {"architecture", device_.architecture},
            {"compute_units", device_.compute_units},
            {"memory_bytes", device_.memory_bytes},
            {"driver_api_version", driver},
            {"runtime_version", runtime},
            {"driver", driver_text()}};
  }
  /// The architectures for which kHasRayInstruction is true.
  bool has_ray_instruction() const override {
    return device_.architecture.starts_with("gfx103") || device_.architecture.starts_with("gfx110");
  }
  unsigned wave_size() const override { return device_.wave_size; }
  unsigned compute_units() const override { return device_.compute_units; }

  build::Result<Memory> allocate(std::size_t bytes) override {
    auto buffer = gpu::DeviceBuffer::make(bytes, nullptr, allocator_);
    if (!buffer) return tl::unexpected(buffer.error());
    return share(std::move(*buffer));
  }
  build::Result<void> write(const Memory& to, std::span<const std::byte> from) override {
    return copy(to.data(), from.data(), from.size(), hipMemcpyHostToDevice);
  }
  build::Result<void> read(const Memory& from, std::span<std::byte> to) const override {
    return copy(to.data(), from.data(), to.size(), hipMemcpyDeviceToHost);
  }
  build::Result<void> fill(const Memory& memory, std::byte value) override {
    if (memory.size() == 0) return {};
    return check(hipMemsetAsync(memory.data(), std::to_integer<int>(value), memory.size(), nullptr), "hipMemsetAsync");
  }
  build::Result<LoadedScene> load(const BufferView& view) override {
    auto scene = gpu::upload_scene(view, nullptr, allocator_);
    if (!scene) return tl::unexpected(scene.error());
    if (auto done = check(hipStreamSynchronize(nullptr), "hipStreamSynchronize"); !done)
      return tl::unexpected(done.error());
    const SceneView on_device = scene->view;
    return LoadedScene{share(std::move(scene->buffer)), on_device};
  }

  build::Result<Resources> resources(const Kernel& kernel) const override {
    hipFuncAttributes attributes{};
    if (auto got = check(hipFuncGetAttributes(&attributes, kernel.gpu), "hipFuncGetAttributes"); !got)
      return tl::unexpected(got.error());
    if (auto divided = gpu::divide_l1(kernel.gpu, kernel.block); !divided) return tl::unexpected(divided.error());
    const auto blocks = gpu::resident_blocks(kernel.gpu, kernel.block, 0);
    if (!blocks) return tl::unexpected(blocks.error());
    hipDeviceProp_t properties{};
    if (auto got = check(hipGetDeviceProperties(&properties, device_.index), "hipGetDeviceProperties"); !got)
      return tl::unexpected(got.error());
    Resources resources;
    resources.registers = static_cast<unsigned>(attributes.numRegs);
    resources.local_bytes = attributes.localSizeBytes;
    resources.shared_bytes = attributes.sharedSizeBytes;
    resources.resident_threads = *blocks * kernel.block;
    resources.occupancy = resources.resident_threads / static_cast<double>(properties.maxThreadsPerMultiProcessor);
    return resources;
  }

  /// Nothing waits between the launches, so the host's work for a launch is hidden behind the previous one.
  build::Result<std::vector<double>> run(const Launch& launch, const Repetitions& repetitions) override {
    for (unsigned i = 0; i < repetitions.warm_up; ++i)
      if (auto done = enqueue(launch); !done) return tl::unexpected(done.error());
    std::vector<gpu::StreamTimer> watches;
    for (unsigned i = 0; i < repetitions.timed; ++i) {
      auto watch = gpu::StreamTimer::make();
      if (!watch) return tl::unexpected(watch.error());
      watches.push_back(std::move(*watch));
    }
    for (gpu::StreamTimer& watch : watches) {
      auto done = watch.start(nullptr);
      if (done) done = enqueue(launch);
      if (done) done = watch.stop(nullptr);
      if (!done) return tl::unexpected(done.error());
    }
    std::vector<double> milliseconds;
    for (const gpu::StreamTimer& watch : watches) {
      const auto time = watch.milliseconds();
      if (!time) return tl::unexpected(time.error());
      milliseconds.push_back(double{*time});
    }
    return milliseconds;
  }

 private:
  /// Waits until the copy is done.
  static build::Result<void> copy(void* to, const void* from, std::size_t bytes, hipMemcpyKind kind) {
    if (bytes == 0) return {};
    if (auto copied = check(hipMemcpyAsync(to, from, bytes, kind, nullptr), "hipMemcpyAsync"); !copied) return copied;
    return check(hipStreamSynchronize(nullptr), "hipStreamSynchronize");
  }

  static build::Result<void> enqueue(const Launch& launch) {
    if (launch.counter != nullptr)
      if (auto reset = check(hipMemsetAsync(launch.counter, 0, sizeof(*launch.counter), nullptr), "hipMemsetAsync");
          !reset)
        return reset;
    const unsigned block = launch.kernel.block;
    const auto grid = launch.grid != 0 ? launch.grid : static_cast<unsigned>((launch.count - 1) / block + 1);
    void* arguments[] = {launch.job};
    return check(hipLaunchKernel(launch.kernel.gpu, dim3(grid), dim3(block), arguments, 0, nullptr), "hipLaunchKernel");
  }

  gpu::DeviceAllocator allocator_;
  gpu::Device device_;
};

}  // namespace

build::Result<std::unique_ptr<Device>> make_gpu_device() {
  auto device = gpu::current_device();
  if (!device) return tl::unexpected(device.error());
  return std::make_unique<GpuDevice>(std::move(*device));
}

}  // namespace hiprt::bench
