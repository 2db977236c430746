#pragma once
/// Warnings of bvhbuild about what it has built.

#include <tools/build/build_scene.h>

namespace hiprt::tools {

class Cli;

/// Warns of triangles and shapes that the builder dropped.
void warn_dropped(const Cli& cli, const build::BuildStatistics& statistics);

/// Warns of damaged entries of the cache, and of a cache that cannot be written.
void warn_cache(const Cli& cli, const CacheCounts& cache);

/// Warns of all that, and of objects whose tree another builder made.
/// @param built of build_scene() or build_objects().
void warn_scene(const Cli& cli, const SceneDescription& scene, const BuiltScene& built);

}  // namespace hiprt::tools
