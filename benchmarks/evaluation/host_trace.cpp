#include "host_trace.h"

#include <benchmarks/common/rounds.h>

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
                     const tools::ThreadLimit& limit) {
  const tools::Query query = any_hit ? tools::Query::kAny : tools::Query::kClosest;
  return trace_batches(rays, hits, limit, [&](std::span<const Ray> part, std::span<Hit> part_hits) {
    tools::trace(scene, query, {}, part, part_hits);
  });
}

}  // namespace hiprt::bench
