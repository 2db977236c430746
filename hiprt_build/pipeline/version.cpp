#include <hiprt_build/build.h>

namespace hiprt::build {

const char* version() { return HIPRT_VERSION_STRING; }

}  // namespace hiprt::build
