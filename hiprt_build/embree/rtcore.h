#pragma once
/// Embree's interface, version 3.13 or 4. Internal: cmake/HiprtEmbree.cmake defines HIPRT_EMBREE_MAJOR.

#if HIPRT_EMBREE_MAJOR == 4
#include <embree4/rtcore.h>
#elif HIPRT_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#else
#error "hiprt: rtcore.h without Embree: HIPRT_EMBREE_MAJOR is neither 3 nor 4"
#endif

namespace hiprt::embree {

/// rtcIntersect1() without a context: Embree 4 has none. @param ray its hit must have RTC_INVALID_GEOMETRY_ID.
inline void intersect1(RTCScene scene, RTCRayHit& ray) {
#if HIPRT_EMBREE_MAJOR == 4
  rtcIntersect1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}

/// rtcOccluded1() likewise. @param ray tfar becomes -infinity if something is hit.
inline void occluded1(RTCScene scene, RTCRay& ray) {
#if HIPRT_EMBREE_MAJOR == 4
  rtcOccluded1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

}  // namespace hiprt::embree
