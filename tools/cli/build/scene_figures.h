#pragma once
/// Counts of a scene of instances: as stored in the file, and as seen by a ray.

#include <tools/cli/report.h>

#include <hiprt_build/format/view.h>

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace hiprt::tools {

/// A count; nothing if it is above 2^64 - 1.
using Count = std::optional<std::uint64_t>;

/// The objects and groups that paths of one length from the scene lead to.
struct SceneLevel {
  Count instances = 0;                    ///< Paths from the scene to an object or group of this level.
  std::uint64_t objects = 0, groups = 0;  ///< Different objects and groups of this level.
};

/// Dropped triangles and custom primitives are counted, dropped instances are not.
struct SceneFigures {
  std::uint64_t objects = 0;                 ///< Of triangles and custom primitives.
  std::uint64_t groups = 1;                  ///< With the scene itself.
  std::uint64_t instances = 0;               ///< Of all groups, each once: those in the file.
  std::uint64_t dropped_instances = 0;       ///< Of empty objects.
  std::uint64_t opened_parts = 0;            ///< Leaves of instances minus instances.
  std::uint64_t moving_instances = 0;        ///< Of those in the file.
  std::uint64_t motion_segments = 0;         ///< Of all motions; one less than keys each.
  std::uint64_t triangles = 0, customs = 0;  ///< Of all objects, each once.
  /// Of the custom primitives of all objects, each once.
  std::uint64_t spheres = 0, curve_segments = 0, moving_triangles = 0;
  Count all_instances = 0;                   ///< Paths from the scene to an object that is not a group.
  Count all_triangles = 0, all_customs = 0;  ///< As often as the scene has them.
  std::uint64_t top_bytes = 0;               ///< The scene's own tree, instances and tables.
  std::uint64_t group_bytes = 0, object_bytes = 0;
  std::uint64_t motion_bytes = 0;  ///< Of motions; those of groups count there too.
  std::vector<SceneLevel> levels;  ///< [0]: the instances that the scene itself has.
};

/// @pre @p scene is of a validated file with instances. An instance whose record names a part of an object (an opened
/// one) counts as all of it.
SceneFigures measure_scene(const BufferView& scene);

void add_scene(Table& table, const SceneFigures& figures);
/// Counts above 2^64 - 1 are null.
nlohmann::json scene_json(const SceneFigures& figures);

}  // namespace hiprt::tools
