#include "gpu_points.h"

namespace hiprt::bench {
namespace {

auto no_gpu() {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "this program was compiled without GPU code"});
}

}  // namespace

build::Result<std::string> gpu_name() { return no_gpu(); }

build::Result<GpuPointRun> ask_gpu(std::span<const std::byte>, std::span<const Vec3>, unsigned, float, unsigned) {
  return no_gpu();
}

}  // namespace hiprt::bench
