/// build_on_gpu() of builds without GPU code.

#include <tools/build/gpu_builder.h>

namespace hiprt::tools {

build::Result<build::Bvh> build_on_gpu(std::span<const build::TriangleMesh>, const build::BuildOptions&) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build (" HIPRT_GPU_REASON ")"});
}

build::Result<build::Bvh> join_on_gpu(std::span<const std::span<const std::byte>>, std::span<const build::Instance>,
                                      const build::InstanceOptions&) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build (" HIPRT_GPU_REASON ")"});
}

}  // namespace hiprt::tools
