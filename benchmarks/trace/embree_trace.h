#pragma once
/// The same queries asked of Embree, ray by ray.

#include <embree3/rtcore.h>
#include <hiprt_device/ray.h>

#include <span>

namespace hiprt::bench {

/// rtcIntersect1 or rtcOccluded1 of rays[i], answered as hits[i]: all that Embree says of a closest hit; of any hit
/// only whether there is one (Hit::found(), t = 0).
void embree_trace(RTCScene scene, bool any_hit, std::span<const Ray> rays, std::span<Hit> hits);

}  // namespace hiprt::bench
