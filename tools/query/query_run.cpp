#include <tools/query/query_run.h>

#include <tools/base/interrupt.h>
#include <tools/query/query_block.h>

#include <algorithm>
#include <atomic>

namespace hiprt::tools {
namespace {

/// Queries per task: fewer than rays, because a query may find many triangles.
constexpr std::size_t kBlock = 256;

}  // namespace

build::Result<QueryResults> run_queries(const QueryWork& work, const ThreadLimit& limit,
                                        const std::function<void(double)>& progress) {
  const std::size_t count = work.batch.size();
  std::vector<QueryBlock> blocks((count + kBlock - 1) / kBlock);
  std::atomic<bool> failed{false};
  const auto run = [&](std::size_t begin, std::size_t end) {
    QueryBlock& block = blocks[begin / kBlock];
    if (!failed && !block.run(work, begin, end) && block.failed()) failed = true;
  };
  if (!parallel_batches(count, kBlock, limit, run, progress) || interrupted()) return cancelled();
  if (failed)
    return fail(build::ErrorCode::kTooLarge,
                "a query needs more stack entries than the file says (" + std::to_string(work.scene.stack_bound) + ")");
  QueryResults results;
  results.each = has_lists(work.kind) ? 0 : work.kind == QueryKind::kNearest ? work.nearest : 1;
  for (QueryBlock& block : blocks) {
    block.append_to(results, work.scene);
    block = {};
  }
  if (results.each == 0) results.first.push_back(results.records());
  return results;
}

}  // namespace hiprt::tools
