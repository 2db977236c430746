// Runs the examples' kernels of closest hits, with each kind of stack, and compares them with the one-call query on the
// host, bit for bit. Prints "N rays, N hits, 0 differ" per kernel.

#include <hip/hip_runtime.h>
#include <hiprt_build/build.h>
#include <hiprt_build/gpu/gpu.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/examples/batch.hip>
#include <tests/examples/closest_hit.hip>
#include <tests/examples/global_stack.hip>
#include <tests/examples/restart_stack.hip>
#include <tests/examples/rolling_stack_host.hip>

#include <cstdio>
#include <cstring>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::Hit, hiprt::Ray;

namespace {

constexpr unsigned kCount = 2000, kSlots = 512;
constexpr std::uint64_t kSeed = 8513;

std::vector<Ray> random_rays() {
  hiprt::oracle::Random random(kSeed);
  std::vector<Ray> rays(kCount);
  for (Ray& ray : rays)
    for (int k = 0; k < 3; ++k) {
      ray.origin[k] = random.uniform_float(-1.2, 1.2);
      ray.direction[k] = random.uniform_float(-1, 1);
    }
  return rays;
}

template <class T> T* device_memory(std::size_t count) {
  T* memory = nullptr;
  if (hipMalloc(&memory, count * sizeof(T)) != hipSuccess) return nullptr;
  return hipMemset(memory, 0, count * sizeof(T)) == hipSuccess ? memory : nullptr;
}

/// Returns 0 if the hits on the device are the expected ones, and clears them.
int compare(const char* name, Hit* device_hits, const std::vector<Hit>& expected) {
  std::vector<Hit> hits(kCount);
  if (hipMemcpy(hits.data(), device_hits, kCount * sizeof(Hit), hipMemcpyDeviceToHost) != hipSuccess ||
      hipMemset(device_hits, 0, kCount * sizeof(Hit)) != hipSuccess) {
    std::printf("%s failed\n", name);
    return 1;
  }
  unsigned found = 0, differ = 0;
  for (unsigned i = 0; i < kCount; ++i) {
    found += hits[i].found() ? 1 : 0;
    differ += std::memcmp(&hits[i], &expected[i], sizeof(Hit)) != 0 ? 1 : 0;
  }
  std::printf("%s: %u rays, %u hits, %u differ\n", name, kCount, found, differ);
  return differ != 0 || found == 0 ? 1 : 0;
}

template <class Kernel, class... Arguments> void start(Kernel kernel, unsigned blocks, const Arguments&... arguments) {
  hipLaunchKernelGGL(kernel, dim3(blocks), dim3(64), 0, nullptr, arguments...);
}

}  // namespace

int main() {
  const hiprt::oracle::Mesh mesh = hiprt::oracle::soup(2000, 0.2, kSeed);
  const std::array<hiprt::build::TriangleMesh, 1> meshes{mesh.view()};
  const auto bvh = hiprt::build::build(meshes);
  if (!bvh) return 1;
  const auto view = hiprt::open_buffer(bvh->buffer.bytes());
  if (!view) return 1;
  gpu::DeviceAllocator allocator;
  const auto uploaded = gpu::upload_scene(bvh->buffer.bytes(), nullptr, allocator);
  if (!uploaded) {
    std::printf("%s\n", uploaded.error().message.c_str());
    return 1;
  }
  const hiprt::SceneView scene = uploaded->view, host_scene = hiprt::make_scene_view(*view);
  const std::vector<Ray> host_rays = random_rays();
  std::vector<Hit> expected(kCount);
  for (unsigned i = 0; i < kCount; ++i) expected[i] = hiprt::closest_hit(host_scene, host_rays[i]);

  const auto rays = gpu::DeviceArray<Ray>::from(host_rays, nullptr, allocator);
  Hit* const hits = device_memory<Hit>(kCount);
  unsigned* const counters = device_memory<unsigned>(2);
  hiprt::SpillPool pool{device_memory<std::uint32_t>(kSlots), nullptr, kSlots, 0};
  // 64 lanes: no device has wider waves.
  pool.memory =
      device_memory<hiprt::StackEntry>(global_stack_bytes(scene, kSlots, 64, pool.entries) / sizeof(hiprt::StackEntry));
  if (!rays || hits == nullptr || counters == nullptr || pool.locks == nullptr || pool.memory == nullptr) return 1;
  const unsigned blocks = (kCount + 63) / 64;

  int faults = 0;
  start(closest_hits, blocks, scene, rays->data(), hits, kCount);
  faults += compare("one call", hits, expected);
  faults += launch_rolling(scene, rays->data(), hits, kCount) == 0 ? 0 : 1;
  faults += compare("rolling", hits, expected);
  start(trace_restarting, blocks, scene, rays->data(), hits, kCount);
  faults += compare("restart", hits, expected);
  start(trace_global, blocks, scene, rays->data(), hits, kCount, pool);
  faults += compare("global", hits, expected);
  start(trace_persistent, 8u, scene, rays->data(), hits, kCount, counters, counters + 1);
  faults += compare("persistent", hits, expected);
  std::printf("%d faults\n", faults);
  return faults;
}
