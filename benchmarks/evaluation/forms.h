#pragma once
/// The same picture as trees of different structure.

#include "scene_source.h"

#include <tools/scene_io/scene/scene_flatten.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hiprt::bench {

/// "flat", "two_level" and "deep".
std::vector<std::string> form_names();

/// Where to look for triangles.
struct Form {
  std::string name;
  unsigned levels = 0;  ///< Of instances. 0: one flat geometry after the other, all in one tree.

  std::vector<tools::FlatGeometry> geometries;  ///< Of levels 0.

  /// Of the others: the objects are the scene's own, groups as SceneDescription::groups.
  const tools::SceneDescription* source = nullptr;
  std::vector<tools::SceneGroup> groups;

  std::uint64_t triangles = 0;  ///< In the form's trees; an object's count once.
  std::uint64_t instances = 0;  ///< In the form's groups.

  /// The meshes of an object, as the library takes them.
  std::vector<build::TriangleMesh> object(std::size_t number) const;
};

/// Levels of instances between a scene and its triangles; 1 or more.
unsigned levels_of(const tools::SceneDescription& scene);

/// - flat: what instances have, transformed (tools/scene_io/scene/scene_flatten.h): one tree without instances.
/// - two_level: one tree over instances of objects; a group in a group becomes as many instances as there are ways to
///   its objects. A scene that is one mesh is one instance of it, which shows what an instance costs.
/// - deep: the groups as the scene has them.
/// @param scene has to live as long as the form.
/// @param most_triangles of flat.
/// @return kTooLarge with the number of triangles or instances and the limit; for deep kInvalidInput if that is what
/// two_level is.
build::Result<Form> make_form(const SourceScene& scene, const std::string& name, std::uint64_t most_triangles);

}  // namespace hiprt::bench
