#pragma once
/// Replaces instances whose transform has no inverse by objects.

#include <tools/scene_io/scene/scene_description.h>

#include <hiprt_build/error.h>

#include <cstdint>
#include <string>

namespace hiprt::tools {

struct BakedInstances {
  std::uint64_t instances = 0;  ///< Counted in the description, not in the scene.
  std::uint64_t triangles = 0;  ///< Of all of them.
  std::string first;            ///< Location of the first one, for messages: "groups.forest[3]".
};

/// Replaces instances without motion whose transform has no inverse (build::is_invertible()). Each becomes an object of
/// its own: its triangles, transformed in double and rounded once, as flatten_scene() makes them. So a ball that is
/// scaled to a flat disc can be traced. An instance whose parts have different masks becomes one instance per mask.
/// Instances that cannot be flattened or are not finite stay; the builder rejects them.
/// @return kTooLarge, kOutOfMemory or kCancelled; after an error the scene is unchanged.
build::Result<BakedInstances> bake_singular(SceneDescription& scene);

}  // namespace hiprt::tools
