#pragma once
/// The same scene as BVHs of different structure.

#include "scene_source.h"

#include <tools/scene_io/scene/scene_flatten.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hiprt::bench {

/// "flat", "two_level" and "deep".
std::vector<std::string> hierarchy_names();

/// A scene as one BVH, or as BVHs of objects with BVHs over their instances.
struct Hierarchy {
  std::string name;
  unsigned levels = 0;  ///< Levels of instances. 0: all geometries in one BVH.

  std::vector<tools::FlatGeometry> geometries;  ///< For levels 0.

  /// For other levels: the scene with the objects. The groups are as in SceneDescription::groups.
  const tools::SceneDescription* source = nullptr;
  std::vector<tools::SceneGroup> groups;

  std::uint64_t triangles = 0;  ///< In the BVHs. The triangles of an object count once.
  std::uint64_t instances = 0;  ///< In the groups.

  /// The meshes of an object, as input of the builders.
  std::vector<build::TriangleMesh> object(std::size_t number) const;
};

/// Levels of instances between the scene and its triangles, at least 1.
unsigned levels_of(const tools::SceneDescription& scene);

/// - flat: one BVH without instances (tools/scene_io/scene/scene_flatten.h).
/// - two_level: one BVH over instances of objects. Nested groups are expanded to one instance per instance path. A
/// single
///   mesh becomes one instance, which shows the cost of an instance.
/// - deep: the scene's groups.
/// @param scene must outlive the hierarchy.
/// @param most_triangles limit of flat.
/// @return kTooLarge with the number of triangles or instances and the limit; kInvalidInput if deep equals two_level.
build::Result<Hierarchy> make_hierarchy(const SourceScene& scene, const std::string& name,
                                        std::uint64_t most_triangles);

}  // namespace hiprt::bench
