#pragma once
/// Materials and textures of all files that are read, in one numbering.

#include <tools/scene_io/surface/surface.h>

#include <cstdint>
#include <vector>

namespace hiprt::tools {

/// Of all textures together: 4 GiB.
inline constexpr std::uint64_t kMostTexels = std::uint64_t{1} << 30;

struct MaterialLibrary {
  std::vector<Texture> textures;
  std::vector<Material> materials;
  std::uint64_t texels = 0;  ///< Of all textures, at most kMostTexels.
};

}  // namespace hiprt::tools
