#pragma once
/// The arrays of a path tracer's scene as bytes, for other ranks and for checksums.

#include <tools/base/digest.h>
#include <tools/render/path/path_data.h>

#include <optional>
#include <span>

namespace hiprt::tools {

std::vector<std::byte> encode(const PathData& data);
/// @param bytes of encode(), of the same program. @return nothing if they are malformed.
std::optional<PathData> decode_path_data(std::span<const std::byte> bytes);

/// Of all arrays: materials, textures, lights and sky.
Digest digest_of(const PathData& data);

}  // namespace hiprt::tools
