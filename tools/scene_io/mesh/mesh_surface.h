#pragma once
/// What triangles and vertices have besides positions.

#include <array>
#include <cstdint>
#include <vector>

namespace hiprt::tools {

/// The attributes of a mesh's triangles and vertices besides positions.
struct MeshSurface {
  std::vector<std::uint32_t> materials;           ///< Per triangle: index in the library.
  std::vector<std::array<float, 2>> coordinates;  ///< Of textures, per vertex; 0: none. Empty: no vertex has any.
  /// Per vertex, unit; 0: none. Empty: no vertex has any. Of a mesh that deforms: at each time, as its positions.
  std::vector<std::array<float, 3>> normals;
};

}  // namespace hiprt::tools
