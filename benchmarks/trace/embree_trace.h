#pragma once
/// The same queries by Embree, ray by ray.

#include <hiprt_build/embree/rtcore.h>
#include <hiprt_device/ray.h>

#include <span>

namespace hiprt::bench {

/// Traces rays[i] into hits[i] by rtcIntersect1 or rtcOccluded1. Closest hits have everything that Embree returns. Any
/// hits only have found() and t = 0.
void embree_trace(RTCScene scene, bool any_hit, std::span<const Ray> rays, std::span<Hit> hits);

}  // namespace hiprt::bench
