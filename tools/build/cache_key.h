#pragma once
/// The name of a built BVH in a cache: a hash of all that its bytes depend on.

#include <tools/build/build_request.h>

#include <hiprt_build/input.h>

#include <string>

namespace hiprt::tools {

/// XXH3-128 of the geometry, the options of the build, the device, the version of the format and that of the library.
/// Threads and progress are left out: files do not depend on them.
/// @return 32 hexadecimal digits.
std::string cache_key(const build::SceneInput& scene, const BuildRequest& request);

}  // namespace hiprt::tools
