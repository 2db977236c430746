#include <tools/base/parallel.h>

#include <tools/base/interrupt.h>

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>

namespace hiprt::tools {

struct ThreadLimit::Workers {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(unsigned threads)
    : threads_(threads == 0 ? static_cast<unsigned>(tbb::info::default_concurrency()) : threads),
      workers_(new Workers{tbb::global_control(tbb::global_control::max_allowed_parallelism, threads_)}) {}

ThreadLimit::~ThreadLimit() = default;

bool parallel_batches(std::size_t count, std::size_t batch, const ThreadLimit& limit,
                      const std::function<void(std::size_t, std::size_t)>& body,
                      const std::function<void(double)>& progress) {
  const std::size_t batches = (count + batch - 1) / batch;
  std::size_t done = 0;
  std::mutex reporting;
  tbb::task_arena arena(static_cast<int>(limit.threads()));
  arena.execute([&] {
    tbb::parallel_for(
        std::size_t{0}, batches,
        [&](std::size_t i) {
          if (interrupted()) return;
          body(i * batch, std::min(count, (i + 1) * batch));
          if (!progress) return;
          const std::lock_guard lock(reporting);
          progress(static_cast<double>(++done) / static_cast<double>(batches));
        },
        tbb::simple_partitioner{});
  });
  return !interrupted();
}

void parallel_each(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& body) {
  if (count == 1) return body(0);
  const ThreadLimit limit(threads);
  tbb::task_arena arena(static_cast<int>(limit.threads()));
  arena.execute([&] { tbb::parallel_for(std::size_t{0}, count, body, tbb::simple_partitioner{}); });
}

}  // namespace hiprt::tools
