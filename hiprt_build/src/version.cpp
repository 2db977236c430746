#include <hiprt_build/version.h>

namespace hiprt::build {

const char* version() noexcept { return HIPRT_VERSION_STRING; }

}  // namespace hiprt::build
