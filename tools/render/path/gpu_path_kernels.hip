// The stages of a path tracer as kernels.

#include <tools/render/path/gpu_path_kernels.h>

namespace hiprt::tools {
/// Not an anonymous namespace: a kernel has one name in both passes of the compiler.
namespace gpu_path_kernels {

template <class Stage> __global__ void __launch_bounds__(kPathBlock) run_stage(PathJob job, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * kPathBlock + threadIdx.x;
  const Stage stage(job);
  if (i < count) stage(i);
}

}  // namespace gpu_path_kernels

PathKernel path_kernel(PathStage stage) {
  switch (stage) {
    case PathStage::kBegin:
      return &gpu_path_kernels::run_stage<BeginPaths>;
    case PathStage::kShade:
      return &gpu_path_kernels::run_stage<ShadePaths>;
    case PathStage::kAddLight:
      return &gpu_path_kernels::run_stage<AddLight>;
    case PathStage::kSum:
      return &gpu_path_kernels::run_stage<SumPaths>;
  }
  return nullptr;
}

}  // namespace hiprt::tools
