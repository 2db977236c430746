#include <hiprt_build/exec/monitor.h>

#include <algorithm>

namespace hiprt::build {
namespace {

std::int64_t now() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

}  // namespace

void Monitor::start(const char* step, double until, std::uint64_t work) {
  if (!callback_) return;
  {
    const std::lock_guard lock(mutex_);
    step_ = step;
    from_ = until_;
    until_ = until;
    work_ = std::max<std::uint64_t>(work, 1);
    done_ = 0;
    report();
  }
  if (cancelled()) throw Cancelled{};
}

void Monitor::check() {
  if (!callback_) return;
  if (now() >= next_call_.load(std::memory_order_relaxed)) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock.owns_lock()) report();
  }
  if (cancelled()) throw Cancelled{};
}

void Monitor::report() {
  const double part = static_cast<double>(done_.load(std::memory_order_relaxed)) / static_cast<double>(work_);
  if (!cancelled() && !callback_(Progress{step_, from_ + (until_ - from_) * std::min(part, 1.0)})) cancelled_ = true;
  next_call_ = now() + interval_;
}

}  // namespace hiprt::build
