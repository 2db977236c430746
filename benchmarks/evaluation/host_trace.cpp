#include "host_trace.h"

#include <benchmarks/common/rounds.h>

#include <vector>

namespace hiprt::bench {

double trace_batches(std::span<const Ray> rays, std::span<Hit> hits, const tools::ThreadLimit& limit,
                     const std::function<void(std::span<const Ray>, std::span<Hit>)>& trace) {
  return time_of([&] {
    tools::parallel_batches(rays.size(), kRayBatch, limit, [&](std::size_t begin, std::size_t end) {
      trace(rays.subspan(begin, end - begin), hits.subspan(begin, end - begin));
    });
  });
}

double trace_on_host(const SceneView& scene, bool any_hit, std::span<const Ray> rays, std::span<Hit> hits,
                     const tools::ThreadLimit& limit, std::span<std::uint32_t> instances) {
  const tools::Query query = any_hit ? tools::Query::kAny : tools::Query::kClosest;
  return trace_batches(rays, hits, limit, [&](std::span<const Ray> part, std::span<Hit> part_hits) {
    std::vector<std::uint32_t> paths(instances.empty() ? 0 : part.size() * scene.levels);
    tools::trace(scene, query, {}, part, part_hits, {}, paths);
    if (instances.empty()) return;
    const std::size_t begin = static_cast<std::size_t>(part.data() - rays.data());
    for (std::size_t i = 0; i < part.size(); ++i) {
      const std::uint32_t outermost = paths[i * scene.levels];
      instances[begin + i] = outermost == kInvalidId ? kInvalidId : scene.instances[outermost].id;
    }
  });
}

}  // namespace hiprt::bench
