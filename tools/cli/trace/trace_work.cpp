#include <tools/cli/trace/trace_work.h>

#include <tools/base/interrupt.h>

#include <chrono>

namespace hiprt::tools {
namespace {

/// Rays per task: enough to hide the cost of scheduling, few enough to balance the load.
constexpr std::size_t kBatch = 4096;

}  // namespace

build::Result<double> trace_batch(const TraceWork& work, std::optional<GpuTracer>& gpu, const ThreadLimit& limit,
                                  const std::function<void(double)>& progress) {
  if (gpu) return gpu->trace(work.query, work.policies, work.rays, work.hits, progress, work.paths);
  const auto start = std::chrono::steady_clock::now();
  const std::size_t levels = work.scene.levels;
  const auto trace_part = [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    trace(work.scene, work.query, work.policies, work.rays.subspan(begin, count), work.hits.subspan(begin, count), {},
          work.paths.subspan(begin * levels, count * levels));
  };
  if (!parallel_batches(work.rays.size(), kBatch, limit, trace_part, progress)) return cancelled();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace hiprt::tools
