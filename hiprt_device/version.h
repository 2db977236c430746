#pragma once
/// The version of the library, for programs that support several.
///
/// CMakeLists.txt reads the three numbers from here. BVH files have a version of their own (hiprt_device/format), and
/// the ABI of the shared library has its SONAME.

#include <hiprt_device/format/portability.h>

#define HIPRT_LIBRARY_MAJOR 0
#define HIPRT_LIBRARY_MINOR 2
#define HIPRT_LIBRARY_PATCH 0

/// One number that grows with every version, for the preprocessor: 10000 * major + 100 * minor + patch.
#define HIPRT_LIBRARY_VERSION (HIPRT_LIBRARY_MAJOR * 10000 + HIPRT_LIBRARY_MINOR * 100 + HIPRT_LIBRARY_PATCH)

namespace hiprt {

/// Version of a library.
struct Version {
  int major_number, minor_number, patch_number;

  /// @return whether this version is @p major_wanted.@p minor_wanted.@p patch_wanted or newer.
  HIPRT_HD constexpr bool at_least(int major_wanted, int minor_wanted, int patch_wanted = 0) const {
    if (major_number != major_wanted) return major_number > major_wanted;
    if (minor_number != minor_wanted) return minor_number > minor_wanted;
    return patch_number >= patch_wanted;
  }
};

/// The version of these headers. build::version() is the version of the compiled library.
inline constexpr Version kVersion{HIPRT_LIBRARY_MAJOR, HIPRT_LIBRARY_MINOR, HIPRT_LIBRARY_PATCH};

}  // namespace hiprt
