#pragma once
/// Instances that rays cannot be taken into.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

#include <cstdint>
#include <string>

namespace hiprt::tools {

struct BakedInstances {
  std::uint64_t instances = 0;  ///< In the description, not in the scene.
  std::uint64_t triangles = 0;  ///< Of all of them.
  std::string first;            ///< Place of the first, for messages: "groups.forest[3]".
};

/// Puts objects of their own in the place of instances that stand still and whose transform has no inverse
/// (build::is_invertible()): their triangles, transformed in double and rounded once, as flatten_scene() makes them. So
/// a disc that is a ball made flat can be traced. An instance whose parts have different masks becomes one of each
/// mask. What cannot be flattened, or is not finite, stays what it is, for the builder to refuse.
/// @return kTooLarge, kOutOfMemory or kCancelled; the scene is as it was then.
build::Result<BakedInstances> bake_singular(SceneDescription& scene);

}  // namespace hiprt::tools
