#pragma once
/// Chooses among kernels that give the same results by measuring them.
///
///     hiprt::gpu::Tuner tuner;
///     const auto start = [&](unsigned candidate) {
///       return hiprt::gpu::launch(kernels[candidate], count, stream, {}, scene, rays, hits, count);
///     };
///     const auto fastest = tuner.choose("shadow", kernels.size(), stream, start);
///     if (fastest) start(*fastest);
///
/// Which schedule, stack or order is fastest depends on the GPU, the scene and the rays (docs/POLICIES.md).

#include <hiprt_build/gpu/device.h>
#include <hiprt_build/gpu/event.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace hiprt::gpu {

/// Remembers which of several candidates is the fastest. One thread at a time may use it.
class Tuner {
 public:
  /// Timed launches of each candidate. Their least time counts: other work can only add to it.
  static constexpr unsigned kRounds = 3;

  /// The first call launches all candidates once, then kRounds times in turn, and waits for the stream. Later calls
  /// with the same key, number of candidates and current device return what the first has found, without a launch.
  /// @param key what the choice is for, such as a scene and a kind of rays. The launches should be typical of it, and
  /// large: a million rays.
  /// @param candidates 1 or more. Of one candidate nothing is measured.
  /// @param start Result<void>(unsigned candidate): enqueues the work of a candidate into @p stream. All candidates
  /// must write the same results, and counters that a launch changes must be set again by each.
  /// @return the number of the fastest candidate, the lowest of equals; kInvalidInput without candidates; or the error
  /// of a launch or of the runtime. After an error nothing is remembered.
  template <class Start>
  Result<unsigned> choose(const std::string& key, unsigned candidates, hipStream_t stream, Start&& start) {
    if (candidates == 0) return fail(ErrorCode::kInvalidInput, "Tuner::choose(\"", key, "\"): no candidates");
    if (candidates == 1) return 0u;
    int device = 0;
    if (auto got = check(hipGetDevice(&device), "hipGetDevice"); !got) return tl::unexpected(std::move(got.error()));
    const auto known = fastest_.find({device, candidates, key});
    if (known != fastest_.end()) return known->second;
    auto found = measure(candidates, stream, start);
    if (found) fastest_.emplace(std::tuple(device, candidates, key), *found);
    return found;
  }

  /// Forgets all choices.
  void clear() { fastest_.clear(); }

 private:
  template <class Start> static Result<unsigned> measure(unsigned candidates, hipStream_t stream, Start& start) {
    auto timer = StreamTimer::make();
    if (!timer) return tl::unexpected(std::move(timer.error()));
    std::vector<float> least(candidates, std::numeric_limits<float>::infinity());
    for (unsigned round = 0; round <= kRounds; ++round)
      for (unsigned candidate = 0; candidate < candidates; ++candidate) {
        Result<void> done = timer->start(stream);
        if (done) done = start(candidate);
        if (done) done = timer->stop(stream);
        if (!done) return tl::unexpected(std::move(done.error()));
        const auto time = timer->milliseconds();
        if (!time) return tl::unexpected(time.error());
        if (round > 0) least[candidate] = std::min(least[candidate], *time);
      }
    return static_cast<unsigned>(std::min_element(least.begin(), least.end()) - least.begin());
  }

  std::map<std::tuple<int, unsigned, std::string>, unsigned> fastest_;  ///< By device, candidates and key.
};

}  // namespace hiprt::gpu
