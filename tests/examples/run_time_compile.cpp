#include <hiprt_build/gpu/compile.h>

#include <cstdio>

constexpr const char* kSource = R"(#include <hiprt_device/hiprt_device.h>
struct Tracer : hiprt::Policies {
  using Triangle = hiprt::TRIANGLE_TEST;  // Chosen at run time.
};
template <class P>
__global__ void trace(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<P>(scene, rays[i]);
})";

int main(int argc, char** argv) {
  const std::vector<std::string> names{"trace<Tracer>"};
  const auto kernels = hiprt::gpu::compile_kernels(
      kSource, names, {.architecture = argc > 1 ? argv[1] : "gfx1030", .flags = {"-DTRIANGLE_TEST=Watertight"}});
  if (!kernels) return std::puts(kernels.error().message.c_str());
  // hipModuleLoadData(), or cuModuleLoadData(), takes kernels->code.data(); ...ModuleGetFunction() takes the name.
  std::printf("compiled: %s\n", kernels->names[0].c_str());
}
