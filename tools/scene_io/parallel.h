#pragma once
/// Loops over batches on several threads.

#include <tbb/global_control.h>

#include <cstddef>
#include <functional>

namespace hiprt::tools {

/// Lets the process run as many threads as long as it lives: oneTBB itself stops at the machine's number.
class ThreadLimit {
 public:
  /// @param threads 0: as many as the machine has.
  explicit ThreadLimit(unsigned threads);

  unsigned threads() const { return threads_; }

 private:
  unsigned threads_;
  tbb::global_control workers_;
};

/// Calls @p body(begin, end) for batches that cover [0, count) once, on as many threads as @p limit says. Batches are
/// started in no particular order.
/// @param progress called behind every batch with the finished part, up to 1, by one thread at a time.
/// @return false when interrupted() became true: batches may be missing then.
bool parallel_batches(std::size_t count, std::size_t batch, const ThreadLimit& limit,
                      const std::function<void(std::size_t begin, std::size_t end)>& body,
                      const std::function<void(double)>& progress = {});

/// Calls @p body(i) for every i below @p count, each once, in no particular order; an interruption does not end it.
/// @param threads 0: as many as the machine has.
void parallel_each(std::size_t count, unsigned threads, const std::function<void(std::size_t i)>& body);

}  // namespace hiprt::tools
