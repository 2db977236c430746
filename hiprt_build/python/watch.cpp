#include <hiprt_build/python/watch.h>

#include <hiprt_build/python/errors.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

namespace hiprt::python {
namespace {

namespace nb = nanobind;
using Clock = std::chrono::steady_clock;
constexpr auto kLook = std::chrono::milliseconds(20), kReport = std::chrono::milliseconds(50);

/// The thread that works, and how it ended.
class Worker {
 public:
  explicit Worker(const std::function<void()>& work) {
    try {
      thread_ = std::thread([this, &work] { run(work); });
    } catch (const std::system_error&) {
      run(work);  // The machine has no thread left.
    }
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() {
    if (thread_.joinable()) thread_.join();
  }

  /// @return whether the work has ended.
  bool wait() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLook, [this] { return ended_; });
  }
  std::exception_ptr failure() const { return failure_; }

 private:
  void run(const std::function<void()>& work) {
    try {
      work();
    } catch (...) {
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::exception_ptr failure_;
  std::thread thread_;
};

/// Throws what the callback raises, and kCancelled if it returns False.
void report(const nb::object& progress, std::uint64_t done, std::uint64_t total) {
  if (progress.is_none()) return;
  const nb::object go_on = progress(done, total);
  if (go_on.is(nb::handle(Py_False)))
    throw LibraryError({build::ErrorCode::kCancelled, "cancelled: the progress callback returned False"});
}

/// What the calling thread does now and then.
void look(const nb::object& progress, const Watch& watch, Clock::time_point& reported) {
  const nb::gil_scoped_acquire with_gil;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
  if (Clock::now() - reported < kReport) return;
  reported = Clock::now();
  report(progress, std::min(watch.done(), watch.total()), watch.total());
}

/// @return what a signal handler or the callback has thrown.
std::exception_ptr watch_over(Worker& worker, const nb::object& progress, Watch& watch) {
  Clock::time_point reported = Clock::now();
  std::exception_ptr raised;
  while (!worker.wait()) {
    if (watch.stopped()) continue;
    try {
      look(progress, watch, reported);
    } catch (...) {
      raised = std::current_exception();
      watch.stop();
    }
  }
  return raised;
}

}  // namespace

void run_watched(const nb::object& progress, Watch& watch, bool small, const std::function<void()>& work) {
  std::exception_ptr raised, failure;
  {
    const nb::gil_scoped_release without_gil;
    if (small) {
      work();
    } else {
      Worker worker(work);
      raised = watch_over(worker, progress, watch);
      failure = worker.failure();
    }
  }
  if (raised) std::rethrow_exception(raised);
  if (failure) std::rethrow_exception(failure);
  report(progress, watch.total(), watch.total());
}

}  // namespace hiprt::python
