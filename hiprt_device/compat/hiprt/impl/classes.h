#pragma once
/// HIPRT's twelve traversal classes. Hints have no effect.

#include <hiprt/impl/traversal.h>

/// Triangles of one geometry: the closest hit.
class hiprtGeomTraversalClosest
    : public hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::TrianglePolicies<hiprtPrivateStack>> {
 public:
  HIPRT_HD hiprtGeomTraversalClosest(hiprtGeometry geom, const hiprtRay& ray,
                                     hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                     hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u)
      : hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::TrianglePolicies<hiprtPrivateStack>>(
            nullptr, geom, ray, payload, funcTable, rayType) {}
};
/// The same with a stack of the caller.
template <class hiprtStack>
class hiprtGeomTraversalClosestCustomStack
    : public hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::TrianglePolicies<hiprtStack>, hiprtStack> {
 public:
  HIPRT_HD hiprtGeomTraversalClosestCustomStack(hiprtGeometry geom, const hiprtRay& ray, hiprtStack& stack,
                                                hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                                hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u)
      : hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::TrianglePolicies<hiprtStack>, hiprtStack>(
            &stack, geom, ray, payload, funcTable, rayType) {}
};
/// Triangles of one geometry: one hit per call, in no order.
class hiprtGeomTraversalAnyHit
    : public hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::TrianglePolicies<hiprtPrivateStack>> {
 public:
  HIPRT_HD hiprtGeomTraversalAnyHit(hiprtGeometry geom, const hiprtRay& ray,
                                    hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                    hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u)
      : hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::TrianglePolicies<hiprtPrivateStack>>(
            nullptr, geom, ray, payload, funcTable, rayType) {}
};
/// The same with a stack of the caller.
template <class hiprtStack>
class hiprtGeomTraversalAnyHitCustomStack
    : public hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::TrianglePolicies<hiprtStack>, hiprtStack> {
 public:
  HIPRT_HD hiprtGeomTraversalAnyHitCustomStack(hiprtGeometry geom, const hiprtRay& ray, hiprtStack& stack,
                                               hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                               hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u)
      : hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::TrianglePolicies<hiprtStack>, hiprtStack>(
            &stack, geom, ray, payload, funcTable, rayType) {}
};
/// Custom primitives, or triangles, of one geometry: the closest hit.
class hiprtGeomCustomTraversalClosest
    : public hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::CustomPolicies<hiprtPrivateStack>> {
 public:
  HIPRT_HD hiprtGeomCustomTraversalClosest(hiprtGeometry geom, const hiprtRay& ray,
                                           hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                           hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u)
      : hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::CustomPolicies<hiprtPrivateStack>>(
            nullptr, geom, ray, payload, funcTable, rayType) {}
};
/// The same with a stack of the caller.
template <class hiprtStack>
class hiprtGeomCustomTraversalClosestCustomStack
    : public hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::CustomPolicies<hiprtStack>, hiprtStack> {
 public:
  HIPRT_HD hiprtGeomCustomTraversalClosestCustomStack(hiprtGeometry geom, const hiprtRay& ray, hiprtStack& stack,
                                                      hiprtTraversalHint = hiprtTraversalHintDefault,
                                                      void* payload = nullptr, hiprtFuncTable funcTable = nullptr,
                                                      uint32_t rayType = 0u)
      : hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::CustomPolicies<hiprtStack>, hiprtStack>(
            &stack, geom, ray, payload, funcTable, rayType) {}
};
/// Custom primitives, or triangles, of one geometry: one hit per call, in no order.
class hiprtGeomCustomTraversalAnyHit
    : public hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::CustomPolicies<hiprtPrivateStack>> {
 public:
  HIPRT_HD hiprtGeomCustomTraversalAnyHit(hiprtGeometry geom, const hiprtRay& ray,
                                          hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                          hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u)
      : hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::CustomPolicies<hiprtPrivateStack>>(
            nullptr, geom, ray, payload, funcTable, rayType) {}
};
/// The same with a stack of the caller.
template <class hiprtStack>
class hiprtGeomCustomTraversalAnyHitCustomStack
    : public hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::CustomPolicies<hiprtStack>, hiprtStack> {
 public:
  HIPRT_HD hiprtGeomCustomTraversalAnyHitCustomStack(hiprtGeometry geom, const hiprtRay& ray, hiprtStack& stack,
                                                     hiprtTraversalHint = hiprtTraversalHintDefault,
                                                     void* payload = nullptr, hiprtFuncTable funcTable = nullptr,
                                                     uint32_t rayType = 0u)
      : hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::CustomPolicies<hiprtStack>, hiprtStack>(
            &stack, geom, ray, payload, funcTable, rayType) {}
};
/// A scene of instances: the closest hit.
class hiprtSceneTraversalClosest
    : public hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::ScenePolicies<hiprtPrivateStack>> {
 public:
  HIPRT_HD hiprtSceneTraversalClosest(hiprtScene scene, const hiprtRay& ray, hiprtRayMask mask = hiprtFullRayMask,
                                      hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                      hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u, float time = 0.0f)
      : hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::ScenePolicies<hiprtPrivateStack>>(
            nullptr, scene, ray, payload, funcTable, rayType, mask, time) {}
};
/// The same with stacks of the caller. The instance stack is not used: the path is in the thread's own memory.
template <class hiprtStack, class hiprtInstanceStack>
class hiprtSceneTraversalClosestCustomStack
    : public hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::ScenePolicies<hiprtStack>, hiprtStack> {
 public:
  HIPRT_HD hiprtSceneTraversalClosestCustomStack(hiprtScene scene, const hiprtRay& ray, hiprtStack& stack,
                                                 hiprtInstanceStack&, hiprtRayMask mask = hiprtFullRayMask,
                                                 hiprtTraversalHint = hiprtTraversalHintDefault,
                                                 void* payload = nullptr, hiprtFuncTable funcTable = nullptr,
                                                 uint32_t rayType = 0u, float time = 0.0f)
      : hiprt::compat_detail::ClosestTraversal<hiprt::compat_detail::ScenePolicies<hiprtStack>, hiprtStack>(
            &stack, scene, ray, payload, funcTable, rayType, mask, time) {}
};
/// A scene of instances: one hit per call, in no order.
class hiprtSceneTraversalAnyHit
    : public hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::ScenePolicies<hiprtPrivateStack>> {
 public:
  HIPRT_HD hiprtSceneTraversalAnyHit(hiprtScene scene, const hiprtRay& ray, hiprtRayMask mask = hiprtFullRayMask,
                                     hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                     hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u, float time = 0.0f)
      : hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::ScenePolicies<hiprtPrivateStack>>(
            nullptr, scene, ray, payload, funcTable, rayType, mask, time) {}
};
/// The same with stacks of the caller. The instance stack is not used: the path is in the thread's own memory.
template <class hiprtStack, class hiprtInstanceStack>
class hiprtSceneTraversalAnyHitCustomStack
    : public hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::ScenePolicies<hiprtStack>, hiprtStack> {
 public:
  HIPRT_HD hiprtSceneTraversalAnyHitCustomStack(hiprtScene scene, const hiprtRay& ray, hiprtStack& stack,
                                                hiprtInstanceStack&, hiprtRayMask mask = hiprtFullRayMask,
                                                hiprtTraversalHint = hiprtTraversalHintDefault, void* payload = nullptr,
                                                hiprtFuncTable funcTable = nullptr, uint32_t rayType = 0u,
                                                float time = 0.0f)
      : hiprt::compat_detail::AnyHitTraversal<hiprt::compat_detail::ScenePolicies<hiprtStack>, hiprtStack>(
            &stack, scene, ray, payload, funcTable, rayType, mask, time) {}
};
