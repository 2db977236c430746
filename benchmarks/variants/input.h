#pragma once
/// Input of the measurement: trees from .bvh files, rays from .rays files or generated from a tree.

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
  std::string name;  ///< The part of the file name between the scene's name and ".bvh".
  std::filesystem::path path;
  build::Buffer buffer;
  BufferView view;
  std::vector<Box> boxes;  ///< Indexed by primitive. Empty: the scene has no custom primitives.
};

/// The rays of one launch.
struct RayBuffer {
  std::string kind;
  bool any_hit = false;
  std::string origin;  ///< Source and order of the rays, for the report.
  std::vector<Ray> rays;
};

/// All *.bvh of a folder, or those of the named scenes.
/// @return kInvalidInput if the folder or a named scene has no file.
build::Result<std::vector<std::filesystem::path>> find_trees(const std::filesystem::path& folder,
                                                             const std::vector<std::string>& scenes);
/// The file name up to the first dot.
std::string scene_of(const std::filesystem::path& path);

/// Validates the whole file.
build::Result<Tree> load_tree(const std::filesystem::path& path);

/// folder/SCENE.KIND.rays.
std::vector<std::filesystem::path> find_rays(const std::filesystem::path& folder, const std::string& scene);
build::Result<RayBuffer> load_rays(const std::filesystem::path& path);

/// Order of generated rays. Consecutive rays share a wave.
enum class PixelOrder {
  kRows,   ///< Row by row.
  kTiles,  ///< Tiles of 8 x 4 pixels row by row, and pixels row by row in each tile: one tile per wave of 32.
};

struct Picture {
  unsigned width = 1920, height = 1080;
  PixelOrder order = PixelOrder::kRows;
};

/// Generates the kinds primary, ao, shadow and diffuse. Traces on the CPU. Rays of ao (any hit) are at most a tenth of
/// the scene's diagonal long. Shadow rays (any hit) go to a point near the centre of the top of the scene's bounds.
/// @param camera_file of tools::parse_camera(); empty: tools::automatic_camera().
/// @param only_primary skips the other kinds, and with them the tracing, which takes long for large pictures.
build::Result<std::vector<RayBuffer>> make_rays(const Tree& tree, const std::filesystem::path& camera_file,
                                                const Picture& picture, bool only_primary);

}  // namespace hiprt::bench
