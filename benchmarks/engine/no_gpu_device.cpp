/// In place of gpu_device.cpp in programs without GPU code.

#include "device.h"

namespace hiprt::bench {

build::Result<std::unique_ptr<Device>> make_gpu_device() {
  return tl::unexpected(
      build::Error{build::ErrorCode::kNoDevice, "built without GPU code (HIPRT_GPU=OFF, or no hipcc and no nvcc)"});
}

}  // namespace hiprt::bench
