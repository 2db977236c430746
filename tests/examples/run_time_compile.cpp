// A kernel that is compiled while the program runs. NVRTC has the same calls with another prefix (nvrtcCreateProgram,
// ...; -arch=sm_90 in place of --offload-arch=gfx1030).

#include <hip/hiprtc.h>

#include <cstdio>
#include <string>
#include <vector>

constexpr const char* kSource = R"(#include <hiprt_device/hiprt_device.h>
struct Tracer : hiprt::Policies {
  using Triangle = hiprt::TRIANGLE_TEST;  // chosen at run time
};
extern "C" __global__ void trace(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<Tracer>(scene, rays[i]);
})";

int main(int argc, char** argv) {
  const std::string include = std::string("-I") + (argc > 1 ? argv[1] : ".");  // The folder that holds hiprt_device/.
  const char* options[] = {"-std=c++20", "--offload-arch=gfx1030", include.c_str(), "-DTRIANGLE_TEST=Watertight"};
  hiprtcProgram program;
  if (hiprtcCreateProgram(&program, kSource, "trace.hip", 0, nullptr, nullptr) != HIPRTC_SUCCESS) return 1;
  const hiprtcResult result = hiprtcCompileProgram(program, 4, options);
  if (result != HIPRTC_SUCCESS) return std::puts(hiprtcGetErrorString(result));  // Details: hiprtcGetProgramLog().
  std::size_t size = 0;
  hiprtcGetCodeSize(program, &size);
  std::vector<char> code(size);
  hiprtcGetCode(program, code.data());  // For hipModuleLoadData() and hipModuleLaunchKernel().
  std::printf("compiled: %s\n", size > 4096 ? "a kernel" : "nothing");
}
