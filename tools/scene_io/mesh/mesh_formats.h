#pragma once
/// One reader per mesh format, over the bytes of a whole file. For load_mesh(), which adds the path to messages, checks
/// the indices and turns exceptions into errors; readers may throw std::bad_alloc.

#include <tools/scene_io/mesh/mesh_import.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// @param surfaces are materials asked for? Then a warning counts what the file has of them.
build::Result<Mesh> read_obj(std::span<const std::byte> bytes, bool surfaces);
build::Result<Mesh> read_ply(std::span<const std::byte> bytes, bool surfaces);
build::Result<Mesh> read_stl(std::span<const std::byte> bytes);
/// @param folder where relative names of buffers lead to. @param library see load_mesh().
build::Result<Mesh> read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                              MaterialLibrary* library);
/// See load_assembly(). @param name of the file, for the names of its meshes.
build::Result<MeshAssembly> read_gltf_assembly(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                                               const std::string& name, const std::vector<float>& times,
                                               MaterialLibrary* library);
/// Raw mesh, compressed with zstd or not.
build::Result<Mesh> read_raw_mesh(std::span<const std::byte> bytes);

/// Whether a file starts as an ASCII STL file does: with the word "solid" in any case, maybe after a byte order mark
/// and blanks. Binary files may start so, too.
bool starts_with_solid(std::span<const std::byte> bytes);

}  // namespace hiprt::tools
