#pragma once
/// Progress and cancellation of a running build. Internal.

#include <hiprt_build/build.h>

#include <atomic>
#include <chrono>
#include <mutex>

namespace hiprt::build {

/// Thrown out of a step when the caller asked to stop; build() turns it into ErrorCode::kCancelled.
struct Cancelled {};

/// Collects work done by all threads and calls the caller's callback now and then, never from two threads at once.
class Monitor {
 public:
  using Interval = std::chrono::steady_clock::duration;

  /// @param interval least time between two calls, except at the start of a step.
  explicit Monitor(const ProgressCallback& callback, Interval interval = std::chrono::milliseconds(20))
      : callback_(callback), interval_(interval.count()) {}

  /// Starts a step that takes the build from its present fraction to @p until.
  /// @param work units that add() will report during the step, at least 1.
  void start(const char* step, double until, std::uint64_t work);

  /// Reports finished work; call after every few microseconds to milliseconds of it. Throws Cancelled.
  void add(std::uint64_t work) {
    if (!callback_) return;
    done_.fetch_add(work, std::memory_order_relaxed);
    check();
  }

  /// Asks the callback when it is time. Throws Cancelled.
  void check();

  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

 private:
  void report();

  const ProgressCallback& callback_;
  std::int64_t interval_;
  std::mutex mutex_;
  std::atomic<std::int64_t> next_call_{0};
  std::atomic<std::uint64_t> done_{0};
  std::atomic<bool> cancelled_{false};
  const char* step_ = "start";
  double from_ = 0, until_ = 0;
  std::uint64_t work_ = 1;
};

}  // namespace hiprt::build
