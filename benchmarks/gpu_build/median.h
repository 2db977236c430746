#pragma once
/// Times work on a stream.

#include <hiprt_build/gpu/event.h>

#include <algorithm>
#include <vector>

namespace hiprt::bench {

/// @return the median device time of @p repeats calls of enqueue() after three others, in milliseconds.
template <class Enqueue> build::Result<double> median_of(unsigned repeats, hipStream_t stream, const Enqueue& enqueue) {
  auto watch = gpu::StreamTimer::make();
  if (!watch) return tl::unexpected(watch.error());
  std::vector<double> times;
  for (unsigned i = 0; i < repeats + 3; ++i) {
    auto done = watch->start(stream);
    if (!done) return tl::unexpected(done.error());
    const auto made = enqueue();
    if (!made) return tl::unexpected(made.error());
    if (done = watch->stop(stream); !done) return tl::unexpected(done.error());
    const auto took = watch->milliseconds();
    if (!took) return tl::unexpected(took.error());
    if (i >= 3) times.push_back(double{*took});
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

}  // namespace hiprt::bench
