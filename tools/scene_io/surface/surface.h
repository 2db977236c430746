#pragma once
/// Appearance of surfaces: materials, textures and vertex attributes from the files that a BVH was built of.

#include <tools/scene_io/surface/texture_wrap.h>

#include <hiprt_build/input.h>

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

/// A picture of 8 bits per channel.
struct Texture {
  std::string name;  ///< For messages.
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint32_t>
      texels;  ///< Row by row, the top row first; red in the lowest byte, then green, blue, alpha.
};

/// A use of a texture. Texture coordinates (u, v), v down as in glTF, are first transformed to matrix * (u, v, 1).
struct TextureUse {
  std::uint32_t texture = std::numeric_limits<std::uint32_t>::max();  ///< The default means no texture.
  TextureWrap wrap_u = TextureWrap::kRepeat, wrap_v = TextureWrap::kRepeat;
  std::array<float, 6> matrix{1, 0, 0, 0, 1, 0};  ///< Rows (KHR_texture_transform).
};

/// glTF 2.0's metallic-roughness material. Factors multiply the textures.
struct Material {
  std::string name;                          ///< For messages.
  std::array<float, 3> base_color{1, 1, 1};  ///< Linear, 0 to 1. Its texture: sRGB.
  float alpha = 1.0f;                        ///< 0 to 1. Its texture: the base colour's.
  float alpha_cutoff = 0.0f;                 ///< Parts with a smaller alpha are cut out. 0: none.
  float metallic = 1.0f, roughness = 1.0f;   ///< 0 to 1. Their texture: blue and green, linear.
  std::array<float, 3> emission{0, 0, 0};    ///< Linear, radiance, not negative. Its texture: sRGB.
  TextureUse base_color_texture, metallic_roughness_texture, emission_texture;
};

/// A geometry of a BVH, with the same numbers: triangles, which may move, or spheres or curve segments of one material.
struct GeometrySurface {
  std::vector<build::Triangle> triangles;         ///< Vertex numbers of each triangle's corners.
  std::vector<std::uint32_t> materials;           ///< One per triangle.
  std::vector<std::array<float, 2>> coordinates;  ///< Of textures, per vertex; empty: none.
  std::vector<std::array<float, 3>> normals;      ///< Per vertex, unit; 0: none. Empty: none at all.
  std::vector<float> times{};                     ///< Of triangles that move; normals has all vertices at each time.
  std::uint64_t shapes = 0;                       ///< Spheres or segments; there are no triangles then.
  std::optional<std::uint32_t> shape_material{};  ///< Theirs; of triangles: none.

  std::uint64_t primitives() const { return shape_material ? shapes : triangles.size(); }
};

/// The surfaces of all objects of a BVH file and of their geometries, in order. A file without instances is one object.
struct SceneSurfaces {
  std::vector<Texture> textures;
  std::vector<Material> materials;
  std::vector<std::vector<GeometrySurface>> objects;
  std::vector<std::string> warnings{};  ///< What of the files was ignored, with their names.
};

}  // namespace hiprt::tools
