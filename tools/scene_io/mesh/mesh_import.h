#pragma once
/// Triangle meshes from files.

#include <tools/scene_io/mesh/mesh_surface.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace hiprt::tools {

struct MaterialLibrary;

/// The triangles of one file, in the file's order of faces.
struct Mesh {
  std::string name;  ///< The file's name without its folder.
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;  ///< Every index is below positions.size() / keys.
  std::vector<std::string> files;          ///< Paths of other files that were read: buffers of glTF.
  std::uint64_t skipped_faces = 0;         ///< Faces with fewer than three corners; they make no triangle.
  std::optional<MeshSurface> surface{};    ///< If it was requested and the format has materials.
  std::vector<std::string> warnings{};     ///< What of the file was ignored or repaired, a line each.
  /// Of a mesh that deforms: the number of requested times, 2 or more. Positions has all vertices at each time, one
  /// time after the other, and all are finite. Else 1.
  std::uint32_t keys = 1;
};

/// Reads a file as one mesh. The extension (in upper or lower case) tells the format; for unknown extensions the first
/// bytes do:
/// - .obj: all objects and groups together; numbers are rounded correctly; materials are not read.
/// - .ply: ASCII and binary of either byte order; faces, and triangle strips with -1 between them ("tristrips").
/// - .stl: ASCII and binary; all solids together; corners are not merged.
/// - .gltf, .glb: glTF 2.0; every triangle primitive of every node of the default scene, with the node's transform
///   (computed in double, rounded once). Mirrored nodes keep their outside. Images are read only for @p library. Skins
///   and morph targets are applied as the nodes are posed without animations (gltf_deform.h).
/// - Others that assimp reads, if this build has it: see mesh_assimp.h.
/// - .mesh, .mesh.zst: u32 vertex count, u32 triangle count, float32 positions, u32 indices, little-endian.
/// Lines of text formats end with LF, CRLF or CR; a UTF-8 byte order mark before the first is skipped.
/// Polygons become size - 2 triangles each (polygons.h). NaN and infinite coordinates are kept: the builder drops and
/// counts such triangles.
/// @param library if given, Mesh::surface of glTF files is filled, and their materials and textures are appended here.
/// @return kIo if the file cannot be read. kInvalidInput, with path, location and limit, if its content is wrong.
/// kTooLarge, kOutOfMemory. kCancelled when interrupted() became true. Never throws.
build::Result<Mesh> load_mesh(const std::filesystem::path& path, MaterialLibrary* library = nullptr);

/// A use of one of a file's meshes.
struct MeshUse {
  std::size_t mesh;
  Transform to_world;
  std::vector<Transform> keys{};  ///< If it moves: its transform at each of the requested times.
};

/// The meshes of one file in their own spaces, and their uses in the file.
struct MeshAssembly {
  std::vector<Mesh> meshes;
  std::vector<MeshUse> uses;
  std::vector<std::string> files;     ///< Paths of other files that were read.
  std::vector<std::string> warnings;  ///< Of the file; its meshes have none.
};

/// As load_mesh(), but keeps every mesh of a glTF file separate, in the order of the file. A mesh has one use per node,
/// or as many as EXT_mesh_gpu_instancing says. Meshes without triangles or without nodes are left out. A node with a
/// skin or with weights of morph targets gets a separate mesh. It deforms (Mesh::keys) if its positions at the times
/// differ. Files that assimp reads are separated likewise. Other files are one mesh that is used once.
/// @param times in seconds, at which animations are evaluated (all of the file at once, gltf_animation.h). Empty:
/// animations are ignored.
/// @param library as for load_mesh().
build::Result<MeshAssembly> load_assembly(const std::filesystem::path& path, const std::vector<float>& times = {},
                                          MaterialLibrary* library = nullptr);

}  // namespace hiprt::tools
