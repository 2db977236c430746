#pragma once
/// The same queries by Embree.

#include <hiprt_build/embree/rtcore.h>
#include <hiprt_device/ray.h>

#include <span>

namespace hiprt::bench {

/// Traces rays[i] into hits[i] by rtcIntersect1 or rtcOccluded1. Closest hits have everything that Embree returns. Any
/// hits only have found() and t = 0.
void embree_trace(RTCScene scene, bool any_hit, std::span<const Ray> rays, std::span<Hit> hits);

/// The same by rtcIntersect8 or rtcOccluded8.
/// @param coherent whether neighbouring rays visit the same nodes.
void embree_trace_eight(RTCScene scene, bool any_hit, bool coherent, std::span<const Ray> rays, std::span<Hit> hits);

}  // namespace hiprt::bench
