#include <tools/render/units/unit_pool.h>

#include <tools/base/interrupt.h>

#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/format/out_of_memory.h>

#include <chrono>
#include <new>
#include <utility>

namespace hiprt::tools {

UnitPool::UnitPool(PictureWork& work) : work_(work) {
  for (unsigned i = 0; i < work.workers(); ++i) threads_.emplace_back([this] { compute(); });
}

UnitPool::~UnitPool() {
  work_.stop();
  const std::lock_guard lock(mutex_);
  stop_ = true;
  changed_.notify_all();
}

void UnitPool::add(UnitJob job) {
  const std::lock_guard lock(mutex_);
  jobs_.push_back(std::move(job));
  changed_.notify_one();
}

std::vector<UnitResult> UnitPool::wait(double seconds) {
  std::unique_lock lock(mutex_);
  computed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return !results_.empty(); });
  return std::exchange(results_, {});
}

void UnitPool::compute() {
  const auto entered = work_.enter();
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stop_ || !jobs_.empty(); });
    if (stop_) return;
    UnitResult result{std::move(jobs_.front()), {}, 0.0, {}};
    jobs_.pop_front();
    lock.unlock();
    build::Stopwatch watch;
    try {
      auto rays = entered ? work_.run(result.job.unit, result.job.state) : tl::unexpected(entered.error());
      if (rays)
        result.rays = *rays;
      else
        result.error = std::move(rays.error());
    } catch (const std::bad_alloc& failure) {
      result.error = build::out_of_memory({"for a unit of the picture"}, failure);
    }
    result.seconds = watch.lap();
    lock.lock();
    if (interrupted()) continue;
    results_.push_back(std::move(result));
    computed_.notify_one();
  }
}

}  // namespace hiprt::tools
