/// In place of gpu_engine.cpp where there is no compiler for GPU code.

#include "engine.h"

namespace hiprt::bench {

build::Result<std::unique_ptr<Engine>> make_gpu_engine() {
  return tl::unexpected<build::Error>(
      build::Error{build::ErrorCode::kNoDevice, "built without GPU code (HIPRT_GPU=OFF, or no hipcc and no nvcc)"});
}

}  // namespace hiprt::bench
