#pragma once
/// How many rays this process may have on their way to each other process.
///
/// A process takes credit before it sends rays and gets it back with their answers. So a receiver never holds more rays
/// than all senders have credit for, and a sender has room for every answer. Nobody waits to get rid of a message.

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

namespace hiprt::tools {

/// Any thread may call it.
class RayCredit {
 public:
  /// @param rays of credit at every process.
  RayCredit(unsigned ranks, std::size_t rays) : free_(ranks, rays) {}

  /// @return how much of @p wanted it could take: nothing if others have all.
  std::size_t take(unsigned rank, std::size_t wanted) {
    const std::lock_guard lock(mutex_);
    const std::size_t taken = std::min(wanted, free_[rank]);
    free_[rank] -= taken;
    return taken;
  }
  void give_back(unsigned rank, std::size_t rays) {
    const std::lock_guard lock(mutex_);
    free_[rank] += rays;
    changed_.notify_all();
  }
  /// Waits until somebody gives credit back, at most for @p timeout.
  void wait(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::size_t> free_;
};

}  // namespace hiprt::tools
