#pragma once
/// FBX, 3DS, COLLADA and other formats that this project has no reader for, through the library assimp.

#include <tools/scene_io/mesh/mesh_import.h>

#include <cstddef>
#include <span>
#include <string>

namespace hiprt::tools {

/// "5.2.5", or why there is none.
std::string assimp_version();

/// Whether this build has assimp (HIPRT_ASSIMP) and assimp reads such files.
/// @param extension in lower case: ".fbx".
bool assimp_reads(const std::string& extension);

/// Why there is no reader for a file, and what to do.
/// @param extension in lower case; may be empty.
build::Error no_reader(const std::string& extension);

/// As load_assembly() and load_mesh(). Meshes have the shape of the file without animations, skins and morph targets;
/// materials are not read. Whatever is ignored is named in a warning. Coordinates are as assimp gives them: those of
/// COLLADA in metres with y up, others in the file's own units and axes. assimp accepts some damaged files, so a
/// warning names it, too.
/// @param name of the file, for the names of its meshes. @pre assimp_reads(extension)
build::Result<MeshAssembly> read_assimp_assembly(std::span<const std::byte> bytes, const std::string& extension,
                                                 const std::string& name);
build::Result<Mesh> read_assimp(std::span<const std::byte> bytes, const std::string& extension);

}  // namespace hiprt::tools
