#pragma once
/// Many rays through the lanes of a kernel whose grid stays: lanes that are done take new rays.

#include <hiprt_device/math/atomic.h>
#include <hiprt_device/math/wave.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Traces rays [0, count) with "persistent threads" and dynamic fetch (Aila and Laine 2009): with
/// WholeWave<kFetchBelow> as the queries' schedule, idle lanes get new rays while the others are on their way. All
/// lanes of a wave call it together; a grid that just fills the device is the right size.
/// @param count below 2^32 minus the threads of the grid.
/// @param next 0 at first, in memory of the device; all waves of the batch count it up, to count plus as many as there
///        are threads at most.
/// @param make a query (ClosestHit or AnyHit) from the number of a ray.
/// @param done called with the number and the query when its answer is there: query.hit().
template <class Make, class Done>
HIPRT_HD HIPRT_INLINE void trace_batch(std::uint32_t count, std::uint32_t* next, Make&& make, Done&& done) {
  if (count == 0) return;
  auto query = make(0);
  query.cancel();
  std::uint32_t ray = 0;
  bool idle = true, more = true;
  for (;;) {
    if (more) {
      const LaneMask lanes = group_ballot(kWholeWave, idle);
      std::uint32_t first = 0;
      if (lane_index() == 0) first = fetch_add(next, lane_count(lanes));
      first = from_first_lane(kWholeWave, first);
      if (idle) {
        ray = first + lanes_before(lanes);
        idle = ray >= count;
        if (!idle) query = make(ray);
      }
      more = first + lane_count(lanes) < count;
    }
    if (!group_any(kWholeWave, !idle)) return;
    const bool answered = query.advance_wave(more);
    if (answered && !idle) {
      done(ray, query);
      query.cancel();
      idle = true;
    }
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
