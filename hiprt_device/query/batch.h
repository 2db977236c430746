#pragma once
/// Batches: many rays through the lanes of a persistent grid. Lanes that are done take new rays.

#include <hiprt_device/math/atomic.h>
#include <hiprt_device/math/wave.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Traces rays [0, count) with persistent threads and dynamic fetch (Aila and Laine 2009).
///
/// The schedule of the queries is WholeWave<kFetchBelow>: idle lanes get new rays while the other lanes still trace.
/// All lanes of a wave call this function together. The right size of the grid is one that just fills the device.
/// @param count below 2^32 minus the threads of the grid.
/// @param next in memory of the device, 0 at first. All waves of the batch count it up, at most to count plus the
/// threads.
/// @param make returns a query (ClosestHit or AnyHit) for the number of a ray.
/// @param done is called with the number and the query when the result is ready: query.hit().
template <class Make, class Done>
HIPRT_HD HIPRT_FORCE_INLINE void trace_batch(std::uint32_t count, std::uint32_t* next, Make&& make, Done&& done) {
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
    const bool is_done = query.advance_wave(more);
    if (is_done && !idle) {
      done(ray, query);
      query.cancel();
      idle = true;
    }
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
