#include <tools/cli/build/build_warnings.h>

#include <tools/cli/cli.h>

#include <string>

namespace hiprt::tools {

void warn_dropped(const Cli& cli, const build::BuildStatistics& statistics) {
  const std::uint64_t not_finite = statistics.dropped_not_finite, degenerate = statistics.dropped_degenerate;
  if (not_finite + degenerate == 0) return;
  const std::string dropped = "dropped " + std::to_string(not_finite + degenerate) + " of ";
  if (statistics.customs == 0)
    cli.warn(dropped + std::to_string(statistics.triangles) + " triangles: " + std::to_string(not_finite) +
             " with a corner that is not finite, " + std::to_string(degenerate) + " with two corners in one place");
  else
    cli.warn(dropped + std::to_string(statistics.triangles + statistics.customs) +
             " primitives: " + std::to_string(not_finite) + " with a corner or a box that is not finite, " +
             std::to_string(degenerate) + " with two corners in one place or a radius of 0");
}

void warn_cache(const Cli& cli, const CacheCounts& cache) {
  if (cache.damaged != 0)
    cli.warn("damaged entries of the cache that were built again: " + std::to_string(cache.damaged) +
             ", the first: " + cache.first_damage);
  if (!cache.first_not_stored.empty()) cli.warn("the cache cannot be written: " + cache.first_not_stored);
}

void warn_scene(const Cli& cli, const SceneDescription& scene, const BuiltScene& built) {
  warn_cache(cli, built.cache);
  warn_dropped(cli, built.objects);
  if (built.other_builder != 0)
    cli.warn(std::string(built.on_gpu ? "the GPU" : "Embree") + " gave up on " + build::name(built.builder) + " for " +
             std::to_string(built.other_builder) + " of " + std::to_string(scene.objects.size()) +
             " objects, the trees would be too deep");
}

}  // namespace hiprt::tools
