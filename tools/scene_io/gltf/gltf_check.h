#pragma once
/// Checks a glTF file's JSON before tinygltf parses it. tinygltf overflows the stack if JSON is nested deeply, and
/// drops values of the wrong kind without an error.

#include <hiprt_build/error.h>

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <span>
#include <string_view>

namespace hiprt::tools {

/// Deeper JSON is rejected.
inline constexpr std::size_t kMaxJsonLevels = 256;

/// Checks the depth, the extensions that the file requires, the version, and all values that triangles depend on.
/// @param file a whole .gltf or .glb file.
/// @return the JSON document; kInvalidInput with the location, e.g. "mesh 0, primitive 1: ...".
build::Result<nlohmann::json> check_gltf(std::span<const std::byte> file);

/// @return the bytes of the binary chunk of a .glb file; none without one. kInvalidInput if the chunk is truncated.
/// @pre check_gltf() has accepted the file.
build::Result<std::span<const unsigned char>> gltf_binary_chunk(std::span<const std::byte> file);

}  // namespace hiprt::tools
