#pragma once
/// The version of the builder library that is linked (which may be newer than the headers one compiled with).

#include <hiprt_build/export.h>

namespace hiprt::build {

/// "major.minor.patch", for example "0.1.0". Static storage.
HIPRT_BUILD_API const char* version() noexcept;

}  // namespace hiprt::build
