#include <tools/base/parallel.h>

#include <hiprt_build/exec/threads.h>
#include <tools/base/interrupt.h>

#include <algorithm>
#include <mutex>

namespace hiprt::tools {

using build::Threads;

struct ThreadLimit::Workers {
  Threads::Limit limit;
};

ThreadLimit::ThreadLimit(unsigned threads)
    : workers_(new Workers{Threads::Limit(threads)}), threads_(threads == 0 ? Threads::count() : threads) {}

ThreadLimit::~ThreadLimit() = default;

bool parallel_batches(std::size_t count, std::size_t batch, const ThreadLimit& limit,
                      const std::function<void(std::size_t, std::size_t)>& body,
                      const std::function<void(double)>& progress) {
  const std::size_t batches = (count + batch - 1) / batch;
  std::size_t done = 0;
  std::mutex reporting;
  Threads::run(limit.threads(), [&] {
    Threads::for_each(batches, [&](std::size_t i) {
      if (interrupted()) return;
      body(i * batch, std::min(count, (i + 1) * batch));
      if (!progress) return;
      const std::lock_guard lock(reporting);
      progress(static_cast<double>(++done) / static_cast<double>(batches));
    });
  });
  return !interrupted();
}

void parallel_each(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& body) {
  if (count == 1) return body(0);
  const ThreadLimit limit(threads);
  Threads::run(limit.threads(), [&] { Threads::for_each(count, body); });
}

}  // namespace hiprt::tools
