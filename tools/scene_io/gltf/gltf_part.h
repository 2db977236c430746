#pragma once
/// The triangles of one primitive of a glTF mesh.

#include <tools/scene_io/mesh/mesh_import.h>
#include <tools/scene_io/transform.h>

#include <hiprt_build/error.h>

#include <array>
#include <cstdint>
#include <vector>

namespace tinygltf {
class Model;
struct Primitive;
}  // namespace tinygltf

namespace hiprt::tools {

/// In the primitive's own space. What a vertex has, all have, or the list is empty.
struct GltfPart {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
  std::vector<std::array<float, 2>> coordinates;  ///< TEXCOORD_0.
  std::vector<std::array<float, 3>> normals;      ///< As the file has them: of any length.
};

/// Does it have triangles, not points or lines?
bool has_triangles(const tinygltf::Primitive& primitive);

/// @param surfaces also texture coordinates and normals?
/// @return kInvalidInput with the accessor or attribute.
build::Result<GltfPart> read_part(const tinygltf::Model& model, const tinygltf::Primitive& primitive, bool surfaces);

/// Appends a part where @p to_world takes it; of a mirrored one the second and third corners of triangles change
/// places, so that its outside stays outside.
/// @param material of all its triangles. Without mesh.surface what belongs there is left out.
/// @return kTooLarge.
build::Result<void> append(Mesh& mesh, const GltfPart& part, const Transform& to_world, std::uint32_t material);

}  // namespace hiprt::tools
