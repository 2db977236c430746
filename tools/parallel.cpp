#include "parallel.h"

#include "progress.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace hiprt::tools {

bool parallel_batches(std::size_t count, std::size_t batch, unsigned threads,
                      const std::function<void(std::size_t, std::size_t)>& body) {
  const std::size_t batches = (count + batch - 1) / batch;
  const int concurrency = threads == 0 ? tbb::this_task_arena::max_concurrency() : static_cast<int>(threads);
  // An arena alone does not raise the number of workers above the machine's.
  const tbb::global_control workers(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(concurrency));
  tbb::task_arena arena(concurrency);
  arena.execute([&] {
    tbb::parallel_for(
        std::size_t{0}, batches,
        [&](std::size_t i) {
          if (!interrupted()) body(i * batch, std::min(count, (i + 1) * batch));
        },
        tbb::simple_partitioner{});
  });
  return !interrupted();
}

}  // namespace hiprt::tools
