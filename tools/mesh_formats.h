#pragma once
/// One reader per mesh format, over the bytes of a whole file. For load_mesh(), which adds the path to messages, checks
/// the indices and turns exceptions into errors; readers may throw std::bad_alloc.

#include "mesh_import.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <utility>

namespace hiprt::tools {

build::Result<Mesh> read_obj(std::span<const std::byte> bytes);
build::Result<Mesh> read_ply(std::span<const std::byte> bytes);
build::Result<Mesh> read_stl(std::span<const std::byte> bytes);
/// @param folder where relative names of buffers lead to.
build::Result<Mesh> read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder);
/// Raw mesh, compressed with zstd or not.
build::Result<Mesh> read_raw_mesh(std::span<const std::byte> bytes);

inline tl::unexpected<build::Error> invalid_input(std::string message) {
  return tl::unexpected<build::Error>(build::Error{build::ErrorCode::kInvalidInput, std::move(message)});
}

}  // namespace hiprt::tools
