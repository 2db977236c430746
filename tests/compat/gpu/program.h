#pragma once
/// A program of HIPRT: two user functions, their dispatchers, and what it does with a ray. Hosts compile it too.

#include <hiprt/hiprt_device.h>
#include <hiprt/hiprt_vec.h>
#include <tests/compat/gpu/results.h>

/// The data of the intersect function: all primitives are squares across the x axis, of one size.
struct SquareData {
  float size;
};

/// No compiler can contract its operations, so that all machines agree to the last bit.
HIPRT_DEVICE inline bool intersectSquare(const hiprtRay& ray, const void* data, void* payload, hiprtHit& hit) {
  const hiprtFloat3 center = static_cast<const hiprtFloat3*>(payload)[hit.primID];
  const float size = static_cast<const SquareData*>(data)->size;
  const hiprtFloat3 to = center - ray.origin;
  const float t = to.x / ray.direction.x;
  if (!(t >= ray.minT && t <= ray.maxT)) return false;
  hit.uv = hiprtFloat2{hiprt::fma(t, ray.direction.y, -to.y), hiprt::fma(t, ray.direction.z, -to.z)};
  if (!(hiprt::max(hit.uv.x, -hit.uv.x) <= size && hiprt::max(hit.uv.y, -hit.uv.y) <= size)) return false;
  hit.t = t;
  hit.normal = to;
  return true;
}

HIPRT_DEVICE inline bool cutOut(const hiprtRay&, const void* data, void*, const hiprtHit& hit) {
  return hit.uv.x > *static_cast<const float*>(data) || (hit.primID & 7u) == 3u;
}

// NOLINTNEXTLINE(misc-definitions-in-headers): one file of a program has it.
HIPRT_DEVICE bool intersectFunc(uint32_t geomType, uint32_t rayType, const hiprtFuncTableHeader& tableHeader,
                                const hiprtRay& ray, void* payload, hiprtHit& hit) {
  const uint32_t index = tableHeader.numGeomTypes * rayType + geomType;
  const void* data = tableHeader.funcDataSets[index].intersectFuncData;
  switch (index) {
    case 0u:
      return intersectSquare(ray, data, payload, hit);
    default:
      return false;
  }
}

// NOLINTNEXTLINE(misc-definitions-in-headers): one file of a program has it.
HIPRT_DEVICE bool filterFunc(uint32_t geomType, uint32_t rayType, const hiprtFuncTableHeader& tableHeader,
                             const hiprtRay& ray, void* payload, const hiprtHit& hit) {
  const uint32_t index = tableHeader.numGeomTypes * rayType + geomType;
  const void* data = tableHeader.funcDataSets[index].filterFuncData;
  switch (index) {
    case 0u:
    case 1u:
      return cutOut(ray, data, payload, hit);
    default:
      return false;
  }
}

/// The arguments of the kernel.
struct Launch {
  hiprtGeometry mesh, squares;
  hiprtScene scene;
  hiprtFuncTable table;
  void* centers;  ///< Of the squares.
  const hiprt::test::TraceRay* rays;
  hiprt::test::TraceResult* results;
  uint32_t count;
};

HIPRT_DEVICE inline hiprt::test::TraceResult resultOf(const hiprtHit& hit, hiprtTraversalState state) {
  hiprt::test::TraceResult result{hit.t, hit.uv.x, hit.uv.y, {hit.normal.x, hit.normal.y, hit.normal.z}, hit.primID};
  result.state = static_cast<uint32_t>(state);
  result.hits = hit.hasHit() ? 1u : 0u;
  for (uint32_t i = 0; i < hiprtMaxInstanceLevels; ++i) result.instance[i] = hit.instanceIDs[i];
  return result;
}

template <class Traversal> HIPRT_DEVICE inline hiprt::test::TraceResult closestOf(Traversal& traversal) {
  const hiprtHit hit = traversal.getNextHit();
  return resultOf(hit, traversal.getCurrentState());
}

/// Sums that do not depend on the order of hits.
template <class Traversal> HIPRT_DEVICE inline hiprt::test::TraceResult sumOf(Traversal& traversal) {
  hiprt::test::TraceResult sum{};
  sum.t = hiprt::FltMax;
  for (;;) {
    const hiprtHit hit = traversal.getNextHit();
    if (traversal.getCurrentState() != hiprtTraversalStateHit) break;
    ++sum.hits;
    sum.t = hiprt::min(sum.t, hit.t);
    sum.primitive += hit.primID;
    for (uint32_t i = 0; i < hiprtMaxInstanceLevels; ++i) sum.instance[i] += hit.instanceIDs[i];
    sum.u = hiprt::max(sum.u, hit.uv.x);
    sum.v = hiprt::max(sum.v, hit.uv.y);
    sum.normal[0] = hiprt::max(sum.normal[0], hit.normal.x);
  }
  sum.state = static_cast<uint32_t>(traversal.getCurrentState());
  return sum;
}

/// All traversals of one ray.
template <class Stack, class InstanceStack>
HIPRT_DEVICE inline void traceRay(const Launch& launch, uint32_t index, Stack& stack, InstanceStack& instanceStack) {
  const hiprt::test::TraceRay& in = launch.rays[index];
  hiprt::test::TraceResult* out = launch.results + index * hiprt::test::kResultsPerRay;
  hiprtRay ray;
  ray.origin = hiprt::make_float3(in.origin[0], in.origin[1], in.origin[2]);
  ray.direction = hiprt::make_float3(in.direction[0], in.direction[1], in.direction[2]);
  ray.minT = in.min_t;
  ray.maxT = in.max_t;
  {
    hiprtGeomTraversalClosestCustomStack traversal(launch.mesh, ray, stack, hiprtTraversalHintDefault, launch.centers,
                                                   launch.table, 0);
    out[0] = closestOf(traversal);
  }
  {
    hiprtGeomTraversalAnyHitCustomStack traversal(launch.mesh, ray, stack, hiprtTraversalHintShadowRays, launch.centers,
                                                  launch.table, 0);
    out[1] = sumOf(traversal);
  }
  {
    hiprtGeomCustomTraversalClosest traversal(launch.squares, ray, hiprtTraversalHintDefault, launch.centers,
                                              launch.table);
    out[2] = closestOf(traversal);
  }
  {
    hiprtGeomCustomTraversalAnyHit traversal(launch.squares, ray, hiprtTraversalHintDefault, launch.centers,
                                             launch.table);
    out[3] = sumOf(traversal);
  }
  {
    hiprtSceneTraversalClosestCustomStack traversal(launch.scene, ray, stack, instanceStack, hiprtFullRayMask,
                                                    hiprtTraversalHintDefault, launch.centers, launch.table, 0,
                                                    in.time);
    out[4] = closestOf(traversal);
    if (out[4].hits != 0u) {
      const hiprtFloat3 normal = hiprt::make_float3(out[4].normal[0], out[4].normal[1], out[4].normal[2]);
      const hiprtFloat3 inWorld = hiprtVectorObjectToWorld(normal, launch.scene, out[4].instance, in.time);
      for (uint32_t i = 0; i < 3; ++i) out[4].normal[i] = hiprt::ptr(inWorld)[i];
    }
  }
  {
    hiprtSceneTraversalAnyHitCustomStack traversal(launch.scene, ray, stack, instanceStack, hiprtFullRayMask,
                                                   hiprtTraversalHintDefault, launch.centers, launch.table, 0, in.time);
    out[5] = sumOf(traversal);
  }
}
