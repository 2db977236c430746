// Runs a program of HIPRT on a GPU and compares with the host, bit for bit. Exit status 0 if all results are equal.

#include <hip/hip_runtime.h>
#include <hiprt_build/gpu/gpu.h>
#include <tests/compat/gpu/program.h>
#include <tests/compat/types.h>

#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

namespace gpu = hiprt::gpu;
using namespace hiprt::test;

constexpr uint32_t kBlockSize = 64;
constexpr uint32_t kSharedStackSize = 16;

// A kernel as programs of HIPRT have them: a fixed name, stacks in shared and global memory.
extern "C" __global__ void __launch_bounds__(kBlockSize)
    TraceKernel(Launch launch, hiprtGlobalStackBuffer stackBuffer) {
  __shared__ uint32_t sharedStackCache[kSharedStackSize * kBlockSize];
  const hiprtSharedStackBuffer sharedStackBuffer{kSharedStackSize, sharedStackCache};
  hiprtGlobalStack stack(stackBuffer, sharedStackBuffer);
  hiprtPrivateInstanceStack instanceStack;
  const uint32_t index = blockIdx.x * blockDim.x + threadIdx.x;
  if (index < launch.count) traceRay(launch, index, stack, instanceStack);
}

namespace {

/// Memory of the device that lives until the end of the program.
class Device {
 public:
  template <class T> T* upload_all(const std::vector<T>& values) {
    auto array = gpu::DeviceArray<T>::from(std::span<const T>(values), nullptr, allocator_);
    if (!array) return fail<T>(array.error());
    (void)hipDeviceSynchronize();  // The values may be gone after this.
    buffers_.push_back(std::make_shared<gpu::DeviceArray<T>>(std::move(*array)));
    return static_cast<gpu::DeviceArray<T>*>(buffers_.back().get())->data();
  }
  template <class T> T* upload(const T& value) { return upload_all(std::vector<T>{value}); }
  /// A file, and its view: what a hiprtGeometry or a hiprtScene points to.
  const hiprt::SceneView* upload_file(std::span<const std::byte> bytes) {
    auto scene = gpu::upload_scene(bytes, nullptr, allocator_);
    if (!scene) return fail<hiprt::SceneView>(scene.error());
    const hiprt::SceneView view = scene->view;
    buffers_.push_back(std::make_shared<gpu::DeviceScene>(std::move(*scene)));
    return upload(view);
  }
  bool failed() const { return failed_; }

 private:
  template <class T> T* fail(const hiprt::build::Error& error) {
    std::fprintf(stderr, "%s\n", error.message.c_str());
    failed_ = true;
    return nullptr;
  }

  gpu::DeviceAllocator allocator_;
  std::vector<std::shared_ptr<void>> buffers_;
  bool failed_ = false;
};

}  // namespace

int main() {
  const TraceInput input = make_input();
  const auto on_host = trace_on_host(input);
  Device device;
  const auto* square = device.upload(SquareData{kSize});
  const auto* limit = device.upload(kFilterLimit);
  const std::vector<hiprtFuncDataSet> sets{{square, limit}, {nullptr, limit}};
  hiprtFuncTableHeader table{2, 1, device.upload_all(sets)};
  Launch launch{};
  launch.mesh = hiprt::geometry_handle(device.upload_file(input.mesh.bytes()));
  launch.squares = hiprt::geometry_handle(device.upload_file(input.squares.bytes()));
  launch.scene = hiprt::scene_handle(device.upload_file(input.scene.bytes()));
  launch.table = device.upload(table);
  launch.centers = device.upload_all(input.centers);
  launch.rays = device.upload_all(input.rays);
  launch.results = device.upload_all(std::vector<TraceResult>(on_host.size()));
  launch.count = static_cast<uint32_t>(input.rays.size());
  if (device.failed()) return 1;
  if (auto done = gpu::launch(TraceKernel, launch.count, nullptr, {.block = kBlockSize}, launch, {}); !done)
    return std::fprintf(stderr, "%s\n", done.error().message.c_str()), 1;
  std::vector<TraceResult> results(on_host.size());
  if (hipMemcpy(results.data(), launch.results, results.size() * sizeof(TraceResult), hipMemcpyDeviceToHost) !=
      hipSuccess)
    return std::fprintf(stderr, "the copy of the results failed\n"), 1;
  unsigned different = 0, hits[kResultsPerRay] = {};
  for (std::size_t i = 0; i < results.size(); ++i) {
    hits[i % kResultsPerRay] += on_host[i].hits;
    different += std::memcmp(&results[i], &on_host[i], sizeof(TraceResult)) != 0 ? 1 : 0;
  }
  bool enough = true;
  for (const unsigned count : hits) enough = enough && count > 20;
  std::printf("%u rays; hits %u %u, %u %u, %u %u; %u results differ\n", launch.count, hits[0], hits[1], hits[2],
              hits[3], hits[4], hits[5], different);
  return different == 0 && enough ? 0 : 1;
}
