#pragma once
/// Checks a glTF file's JSON before tinygltf parses it. tinygltf overflows the stack if JSON is nested deeply, and
/// drops values of the wrong kind without an error.

#include <hiprt_build/error.h>

#include <cstddef>
#include <span>
#include <string_view>

namespace hiprt::tools {

/// Deeper JSON is rejected.
inline constexpr std::size_t kMaxJsonLevels = 256;

/// Checks the version, the depth, and all values that the triangles depend on.
/// @param file a whole .gltf or .glb file.
/// @return kInvalidInput with the location, e.g. "mesh 0, primitive 1: ...".
build::Result<void> check_gltf(std::span<const std::byte> file);

/// @return the JSON text of a .gltf or .glb file, or kInvalidInput if the file is truncated or of another version.
build::Result<std::string_view> gltf_json(std::span<const std::byte> file);

}  // namespace hiprt::tools
