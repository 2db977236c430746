#pragma once
/// Replaces instances whose transform has no inverse by objects.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

#include <cstdint>
#include <string>

namespace hiprt::tools {

struct BakedInstances {
  std::uint64_t instances = 0;  ///< In the description, not in the scene.
  std::uint64_t triangles = 0;  ///< Of all of them.
  std::string first;            ///< Location of the first one, for messages: "groups.forest[3]".
};

/// Replaces by objects of their own the instances that stand still and whose transform has no inverse
/// (build::is_invertible()): their triangles, transformed in double and rounded once, as flatten_scene() makes them. So
/// a disc that is a ball made flat can be traced. An instance whose parts have different masks becomes one of each
/// mask. Instances that cannot be flattened or are not finite stay: the builder refuses them.
/// @return kTooLarge, kOutOfMemory or kCancelled; the scene is as it was then.
build::Result<BakedInstances> bake_singular(SceneDescription& scene);

}  // namespace hiprt::tools
