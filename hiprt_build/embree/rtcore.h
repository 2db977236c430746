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

/// rtcIntersect8() likewise.
/// @param valid -1 for each ray that exists, else 0. @param coherent whether the rays visit the same nodes.
inline void intersect8(const int (&valid)[8], RTCScene scene, RTCRayHit8& rays, bool coherent) {
#if HIPRT_EMBREE_MAJOR == 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcIntersect8(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcIntersect8(valid, scene, &context, &rays);
#endif
}

/// rtcOccluded8() likewise.
inline void occluded8(const int (&valid)[8], RTCScene scene, RTCRay8& rays, bool coherent) {
#if HIPRT_EMBREE_MAJOR == 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcOccluded8(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcOccluded8(valid, scene, &context, &rays);
#endif
}

}  // namespace hiprt::embree
