#pragma once
/// Runs long work on another thread. The calling thread looks for Ctrl-C and reports progress.

#include <nanobind/nanobind.h>

#include <atomic>
#include <cstdint>
#include <functional>

namespace hiprt::python {

/// How far the work is, and whether it should stop. Any thread may use it.
class Watch {
 public:
  /// @param total units of work.
  explicit Watch(std::uint64_t total) : total_(total) {}

  void add(std::uint64_t work) { done_.fetch_add(work, std::memory_order_relaxed); }
  void set(std::uint64_t done) { done_.store(done, std::memory_order_relaxed); }
  void stop() { stopped_.store(true, std::memory_order_relaxed); }
  bool stopped() const { return stopped_.load(std::memory_order_relaxed); }
  std::uint64_t done() const { return done_.load(std::memory_order_relaxed); }
  std::uint64_t total() const { return total_; }

 private:
  std::uint64_t total_;
  std::atomic<std::uint64_t> done_{0};
  std::atomic<bool> stopped_{false};
};

/// Runs work() without the GIL, on another thread. The calling thread handles Python's signals every 20 ms. It calls
/// progress(done, total) every 50 ms and at the end. If a signal handler or the callback raises, or the callback
/// returns False, the watch is stopped. The exception is thrown when work() has returned.
/// @param progress a callable, or None.
/// @param work must return soon after the watch was stopped.
/// @param small the work takes milliseconds at most: it runs on the calling thread, and signals wait.
/// @pre the calling thread holds the GIL.
void run_watched(const nanobind::object& progress, Watch& watch, bool small, const std::function<void()>& work);

}  // namespace hiprt::python
