#pragma once
/// What is traced: trees from .bvh files, rays from .rays files or made from a tree.

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/ray.h>

#include <filesystem>
#include <string>
#include <vector>

namespace hiprt::bench {

/// SCENE.NAME.bvh, and the boxes of its custom primitives from SCENE.boxes (u32 count, count x 6 float32 {min, max}).
struct Tree {
  std::string scene;
  std::string name;  ///< Of the tree among those of its scene: what is between the scene's name and ".bvh".
  std::filesystem::path path;
  build::Buffer buffer;
  BufferView view;
  std::vector<Box> boxes;  ///< By number within their geometry. Empty: the scene has no custom primitives.
};

/// The rays of one launch.
struct RayBuffer {
  std::string kind;
  bool any_hit = false;
  std::string origin;  ///< Where they come from and in which order they are, for people.
  std::vector<Ray> rays;
};

/// All *.bvh of a folder by scene, or those of the named scenes.
/// @return kInvalidInput if there is none, or none of a named scene.
build::Result<std::vector<std::filesystem::path>> find_trees(const std::filesystem::path& folder,
                                                             const std::vector<std::string>& scenes);
/// The name before the first point.
std::string scene_of(const std::filesystem::path& path);

/// The file is checked to the last byte.
build::Result<Tree> load_tree(const std::filesystem::path& path);

/// folder/SCENE.KIND.rays.
std::vector<std::filesystem::path> find_rays(const std::filesystem::path& folder, const std::string& scene);
build::Result<RayBuffer> load_rays(const std::filesystem::path& path);

/// In which rays are generated, and lie side by side in waves.
enum class PixelOrder {
  kRows,   ///< Row by row.
  kTiles,  ///< Tiles of 8 x 4 pixels row by row, and so are the pixels in each: a wave of 32 sees a compact part.
};

struct Picture {
  unsigned width = 1920, height = 1080;
  PixelOrder order = PixelOrder::kRows;
};

/// Kinds primary, ao (any hit, at most a tenth of the scene's diagonal long), shadow (any hit, to a point below the
/// middle of the top of the scene's bounds) and diffuse, traced on the CPU.
/// @param camera_file of tools::parse_camera(); empty: tools::automatic_camera().
/// @param only_primary nothing is traced, which takes long for large pictures.
build::Result<std::vector<RayBuffer>> make_rays(const Tree& tree, const std::filesystem::path& camera_file,
                                                const Picture& picture, bool only_primary);

}  // namespace hiprt::bench
