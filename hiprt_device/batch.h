#pragma once
/// Many rays through the lanes of a kernel whose grid stays: a lane that is done takes the next ray.

#include <hiprt_device/atomic.h>
#include <hiprt_device/wave.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// One number per active lane, counted on from *next: one atomic operation for the wave.
HIPRT_HD HIPRT_INLINE std::uint32_t take_numbers(std::uint32_t* next) {
  const LaneMask lanes = wave_ballot(true);
  std::uint32_t first = 0;
  if (lanes_before(lanes) == 0) first = fetch_add(next, lane_count(lanes));
  return from_first_lane(lanes, first) + lanes_before(lanes);
}

/// Traces rays [0, count) with all lanes that call this: "persistent threads" with dynamic fetch (Aila and Laine 2009).
/// With a schedule that pauses (Postponed<kFetchBelow>) idle lanes get new rays while the others are on their way:
/// lane utilisation for incoherent closest hits.
/// @param next 0 at first, in memory of the device; all waves of the batch count it up.
/// @param make a query (ClosestHit or AnyHit) from the number of a ray.
/// @param done called with the number and the query when its answer is there: query.hit().
template <class Make, class Done>
HIPRT_HD HIPRT_INLINE void trace_batch(std::uint32_t count, std::uint32_t* next, Make&& make, Done&& done) {
  std::uint32_t ray = take_numbers(next);
  if (ray >= count) return;
  auto query = make(ray);
  for (;;) {
    if (query.advance()) {
      done(ray, query);
      ray = take_numbers(next);
      if (ray >= count) return;
      query = make(ray);
    }
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
