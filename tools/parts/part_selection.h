#pragma once
/// What a part has of a scene: groups, objects and surfaces.

#include <tools/build/build_scene.h>
#include <tools/parts/scene_map.h>

namespace hiprt::tools {

/// The groups of the scene, with the instances that lead to the pieces, and the files that these need.
/// @param pieces ascending, not empty.
SceneSelection select(const SceneDescription& scene, const SceneMap& map, std::span<const ScenePiece> pieces);

/// The surfaces of some objects, with the materials and textures that they use.
/// @param objects numbers in SceneSurfaces::objects. The result has them in this order.
SceneSurfaces select(const SceneSurfaces& all, std::span<const std::uint32_t> objects);

}  // namespace hiprt::tools
