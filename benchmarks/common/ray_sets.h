#pragma once
/// The rays of a scene by kind.

#include <hiprt_build/error.h>
#include <hiprt_device/ray.h>
#include <tools/render/scene/camera.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace hiprt::bench {

struct RaySet {
  std::string kind;  ///< "primary", "ao", "shadow", "diffuse" or "diffuse2".
  bool any_hit = false;
  std::vector<Ray> rays;
};

/// @return the kinds that have a file folder/NAME.KIND.rays.
std::vector<std::string> stored_kinds(const std::filesystem::path& folder, const std::string& scene);

/// Reads folder/NAME.KIND.rays and keeps about @p wanted of its rays.
build::Result<RaySet> read_ray_set(const std::filesystem::path& folder, const std::string& scene,
                                   const std::string& kind, std::uint32_t wanted);

/// @return the kinds that generate_ray_sets() makes.
std::vector<std::string> generated_kinds();

/// Makes about @p wanted primary rays of a picture of 1920 x 1080, and spawns two cosine-weighted rays from each hit
/// (spawn_origin()). The ao ray (any hit) is at most a tenth of the scene's diagonal long. The diffuse ray looks for
/// the closest hit.
build::Result<std::vector<RaySet>> generate_ray_sets(const tools::Mesh& mesh, const tools::Camera& camera,
                                                     std::uint32_t wanted);

}  // namespace hiprt::bench
