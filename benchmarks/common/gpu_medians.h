#pragma once
/// Times work on a stream.

#include <hiprt_build/gpu/event.h>

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

namespace hiprt::bench {

/// Starts work on a stream.
using Enqueue = std::function<build::Result<void>()>;

/// Calls all contestants in turn, @p repeats times after three others, so that they are comparable on a noisy machine.
/// @return the median device time of each, in milliseconds.
inline build::Result<std::vector<double>> medians_of(std::span<const Enqueue> contestants, unsigned repeats,
                                                     hipStream_t stream) {
  auto watch = gpu::StreamTimer::make();
  if (!watch) return tl::unexpected(watch.error());
  std::vector<std::vector<double>> times(contestants.size());
  for (unsigned i = 0; i < repeats + 3; ++i)
    for (std::size_t k = 0; k < contestants.size(); ++k) {
      auto done = watch->start(stream);
      if (done) done = contestants[k]();
      if (done) done = watch->stop(stream);
      if (!done) return tl::unexpected(done.error());
      const auto took = watch->milliseconds();
      if (!took) return tl::unexpected(took.error());
      if (i >= 3) times[k].push_back(double{*took});
    }
  std::vector<double> medians;
  for (std::vector<double>& of_one : times) {
    std::sort(of_one.begin(), of_one.end());
    medians.push_back(of_one[of_one.size() / 2]);
  }
  return medians;
}

/// The median of one contestant. @p enqueue returns a Result of any type.
template <class Work> build::Result<double> median_of(unsigned repeats, hipStream_t stream, const Work& enqueue) {
  const Enqueue contestant = [&]() -> build::Result<void> {
    const auto made = enqueue();
    if (!made) return tl::unexpected(made.error());
    return {};
  };
  const auto medians = medians_of({&contestant, 1}, repeats, stream);
  if (!medians) return tl::unexpected(medians.error());
  return medians->front();
}

}  // namespace hiprt::bench
