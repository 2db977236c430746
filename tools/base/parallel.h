#pragma once
/// Loops over batches on several threads.

#include <cstddef>
#include <functional>
#include <memory>

namespace hiprt::tools {

/// While it lives, loops may run this many threads, also more than the machine has.
class ThreadLimit {
 public:
  /// @param threads 0: as many as the machine has.
  explicit ThreadLimit(unsigned threads);
  ~ThreadLimit();

  unsigned threads() const { return threads_; }

 private:
  struct Workers;

  std::unique_ptr<Workers> workers_;
  unsigned threads_;
};

/// Splits [0, count) into batches and calls @p body(begin, end) once for each, in no particular order.
/// @param progress called after every batch with the finished fraction, by one thread at a time.
/// @return false if interrupted() became true: some batches may be missing then.
bool parallel_batches(std::size_t count, std::size_t batch, const ThreadLimit& limit,
                      const std::function<void(std::size_t begin, std::size_t end)>& body,
                      const std::function<void(double)>& progress = {});

/// Calls @p body(i) once for every i below @p count, in no particular order. It ignores interruptions.
/// @param threads 0: as many as the machine has.
void parallel_each(std::size_t count, unsigned threads, const std::function<void(std::size_t i)>& body);

}  // namespace hiprt::tools
