#pragma once
/// Points in a stream, and the time between two of them.

#include <hiprt_build/gpu/error.h>

#include <utility>

namespace hiprt::gpu {

/// Move-only point in a stream's work.
class Event {
 public:
  /// Holds no event; only good to be assigned to.
  Event() = default;

  static Result<Event> make() {
    Event event;
    if (auto made = check(hipEventCreate(&event.event_), "hipEventCreate"); !made)
      return tl::unexpected(std::move(made.error()));
    return event;
  }

  Event(Event&& other) noexcept : event_(std::exchange(other.event_, nullptr)) {}
  Event& operator=(Event&& other) noexcept {
    std::swap(event_, other.event_);
    return *this;
  }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event() {
    if (event_ != nullptr) error_detail::ignore(hipEventDestroy(event_));
  }

  hipEvent_t get() const { return event_; }

  /// Puts the event behind all work that is in @p stream now; a second time moves it.
  Result<void> record(hipStream_t stream) { return check(hipEventRecord(event_, stream), "hipEventRecord"); }

  /// Waits until the work before the event is done. @return also the errors of that work.
  Result<void> synchronize() const { return check(hipEventSynchronize(event_), "hipEventSynchronize"); }

  /// Whether the work before the event is done, or failed. Does not wait.
  bool is_reached() const { return hipEventQuery(event_) != hipErrorNotReady; }

  /// Milliseconds of the device from @p start to this event, both recorded and reached.
  Result<float> milliseconds_since(const Event& start) const {
    float milliseconds = 0.0f;
    if (auto got = check(hipEventElapsedTime(&milliseconds, start.event_, event_), "hipEventElapsedTime"); !got)
      return tl::unexpected(std::move(got.error()));
    return milliseconds;
  }

 private:
  hipEvent_t event_ = nullptr;
};

/// Device time of what a stream does between start() and stop().
class StreamTimer {
 public:
  static Result<StreamTimer> make() {
    StreamTimer watch;
    for (Event* event : {&watch.start_, &watch.stop_}) {
      auto made = Event::make();
      if (!made) return tl::unexpected(std::move(made.error()));
      *event = std::move(*made);
    }
    return watch;
  }

  Result<void> start(hipStream_t stream) { return start_.record(stream); }
  Result<void> stop(hipStream_t stream) { return stop_.record(stream); }

  /// Milliseconds between the two; waits until stop() is reached.
  Result<float> milliseconds() const {
    if (auto reached = stop_.synchronize(); !reached) return tl::unexpected(std::move(reached.error()));
    return stop_.milliseconds_since(start_);
  }

 private:
  StreamTimer() = default;

  Event start_, stop_;
};

}  // namespace hiprt::gpu
