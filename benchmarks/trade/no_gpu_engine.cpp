#include "engine.h"

namespace hiprt::bench {

build::Result<std::unique_ptr<Engine>> make_gpu_engine() {
  return tl::unexpected(build::Error{build::ErrorCode::kBackend, "this program was built without GPU code"});
}

}  // namespace hiprt::bench
