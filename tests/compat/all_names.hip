// Every class and function of HIPRT's names in kernels, beside a kernel of this library. Compiling is the test, also by
// run-time compilers.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

#include <hiprt/hiprt_common.h>
#include <hiprt/hiprt_device.h>
#include <hiprt/hiprt_math.h>
#include <hiprt/hiprt_vec.h>
#include <hiprt/impl/hiprt_device_impl.h>

using namespace hiprt;

HIPRT_DEVICE bool intersectFunc(uint32_t geomType, uint32_t rayType, const hiprtFuncTableHeader& tableHeader,
                                const hiprtRay& ray, void*, hiprtHit& hit) {
  const uint32_t index = tableHeader.numGeomTypes * rayType + geomType;
  const float4* spheres = static_cast<const float4*>(tableHeader.funcDataSets[index].intersectFuncData);
  const float3 center = make_float3(spheres[hit.primID]), from = ray.origin - center;
  const float a = dot(ray.direction, ray.direction), b = dot(from, ray.direction), radius = spheres[hit.primID].w;
  const float d = differenceOfProducts(b, b, a, dot(from, from) - radius * radius);
  if (d < 0.0f) return false;
  hit.t = (-b - sqrtf(d)) / a;
  hit.normal = normalize(from + hit.t * ray.direction);
  return true;
}
HIPRT_DEVICE bool filterFunc(uint32_t, uint32_t, const hiprtFuncTableHeader&, const hiprtRay&, void* payload,
                             const hiprtHit& hit) {
  return hit.primID == *static_cast<const uint32_t*>(payload);
}

/// A program's own stack.
class OwnStack {
 public:
  HIPRT_DEVICE uint32_t pop() { return entries_[--size_]; }
  HIPRT_DEVICE void push(uint32_t entry) { entries_[size_++] = entry; }
  HIPRT_DEVICE bool empty() const { return size_ == 0u; }
  HIPRT_DEVICE uint32_t vacancy() const { return 48u - size_; }
  HIPRT_DEVICE void reset() { size_ = 0u; }

 private:
  uint32_t entries_[48];
  uint32_t size_;
};

template <class Traversal> HIPRT_DEVICE uint32_t countHits(Traversal& traversal) {
  uint32_t hits = 0u;
  while (traversal.getCurrentState() != hiprtTraversalStateFinished)
    if (traversal.getNextHit().hasHit()) ++hits;
  return hits;
}

extern "C" __global__ void GeometryKernel(hiprtGeometry geometry, hiprtRay ray, hiprtFuncTable table, uint32_t* hits) {
  OwnStack own;
  hiprtPrivateStack stack;
  hiprtGeomTraversalClosest a(geometry, ray, hiprtTraversalHintDefault, nullptr, table, 1);
  hits[0] = countHits(a);
  hiprtGeomTraversalAnyHit b(geometry, ray);
  hits[1] = countHits(b);
  hiprtGeomCustomTraversalClosest c(geometry, ray, hiprtTraversalHintReflectionRays);
  hits[2] = countHits(c);
  hiprtGeomCustomTraversalAnyHit d(geometry, ray);
  hits[3] = countHits(d);
  hiprtGeomTraversalClosestCustomStack e(geometry, ray, own);
  hits[4] = countHits(e);
  hiprtGeomTraversalAnyHitCustomStack<hiprtPrivateStack> f(geometry, ray, stack);
  hits[5] = countHits(f);
  hiprtGeomCustomTraversalClosestCustomStack g(geometry, ray, stack);
  hits[6] = countHits(g);
  hiprtGeomCustomTraversalAnyHitCustomStack h(geometry, ray, own);
  hits[7] = countHits(h);
}

extern "C" __global__ void SceneKernel(hiprtScene scene, hiprtRay ray, hiprtGlobalStackBuffer buffer,
                                       hiprtGlobalStackBuffer instanceBuffer, uint32_t* hits) {
  __shared__ uint32_t cache[64 * 8];
  // Not in its initialiser: at -O0 clang 15 makes a constant of it, which cannot hold an address of shared memory.
  hiprtSharedStackBuffer shared{};
  shared.stackSize = 8;
  shared.stackData = cache;
  const hiprtSharedStackBuffer none{};
  hiprtDynamicStack stack(buffer, shared);
  hiprtGlobalInstanceStack instanceStack(instanceBuffer, none);
  hiprtDynamicInstanceStack otherStack(instanceBuffer, none);
  hiprtEmptyInstanceStack empty;
  OwnStack own;
  hiprtSceneTraversalClosest a(scene, ray);
  hits[0] = countHits(a);
  hiprtSceneTraversalAnyHit b(scene, ray, 1u, hiprtTraversalHintShadowRays, nullptr, nullptr, 0, 0.5f);
  hits[1] = countHits(b);
  hiprtSceneTraversalClosestCustomStack c(scene, ray, stack, instanceStack);
  hits[2] = countHits(c);
  hiprtSceneTraversalAnyHitCustomStack d(scene, ray, own, empty);
  hits[3] = countHits(d);
  hiprtSceneTraversalAnyHitCustomStack e(scene, ray, stack, otherStack);
  hits[4] = countHits(e);
}

extern "C" __global__ void VectorKernel(float3* v, float* f, int* n, hiprtScene scene) {
  const float3 a = v[0], b = v[1];
  v[2] = a + b - 2.0f * a * b / 3.0f;
  v[2] += a;
  v[2] *= 2.0f;
  v[2] -= b;
  v[2] /= 3.0f;
  v[3] = -a;
  v[4] = hiprt::min(a, b) + hiprt::max(a, b) + cross(a, b) + normalize(a) + hiprt::fma(a, b, a) + mix(a, b, 0.5f);
  v[5] = hiprt::clamp(a, 0.0f, 1.0f);
  v[6] = make_float3(1.0f, 2.0f, 3.0f) + hiprt::make_float3(2.0f) + make_float3(make_float4(a, 1.0f)) +
         make_float3(make_int3(1, 2, 3)) + make_float3(n[0], n[1], n[2]) + make_float3(make_float2(f[1], f[2]), 1.0f);
  f[0] = dot(a, b) + max(f[2], 0.0f) + min(f[3], f[4]) + hiprt::max(f[3], 1.0f) + hiprt::fma(f[0], f[1], f[2]);
  f[1] = hiprt::hypot(f[0], f[1]) + hiprt::sign(f[0]) + hiprt::sumOfProducts(f[0], f[1], f[2], f[3]) + ptr(a)[1];
  f[2] = Pi + TwoPi + FltMax + FltMin + as_float(n[0]) + atomicMinFloat(f, f[9]) + hiprt::atomicMaxFloat(f, f[9]);
  n[1] = as_int(f[1]) + static_cast<int>(as_uint(f[2]) + clz(as_uint(n[3])));
  n[2] = shfl(n[4], 3) + shfl_up(n[4], 1) + shfl_down(n[4], 1) + shfl_xor(n[4], 1);
  n[3] = static_cast<int>(hiprt::ballot(n[5] > 0) & 255u) + (hiprt::any(n[6]) ? 1 : 0) + (hiprt::all(n[6]) ? 1 : 0);
  n[4] = min(n[7], 3) + max(n[7], n[9]) + hiprt::clamp(n[9], 1, 2) + (a == b ? 1 : 0) + (a != b ? 1 : 0);
  n[5] = static_cast<int>(RoundUp(9u, WarpSize) + DivideRoundUp(9u, 4u) + Log2(17u) + BranchingFactor + Rtip);
  const uint32_t ids[4] = {1, 2, InvalidValue, hiprtInvalidValue};
  v[7] = hiprtPointObjectToWorld(a, scene, 3u) + hiprtVectorWorldToObject(a, scene, 3u, 0.5f) +
         hiprtVectorObjectToWorld(a, scene, ids, 0.1f) + hiprtPointWorldToObject(a, scene, ids);
  f[3] = hiprtGetObjectToWorldFrameMatrix(scene, ids, 0.0f).matrix[1][2] +
         hiprtGetWorldToObjectFrameMatrix(scene, 1u, 0.0f).matrix[1][2] +
         hiprtGetObjectToWorldFrameSRT(scene, 1u, 0.0f).rotation.w +
         hiprtGetWorldToObjectFrameSRT(scene, 1u, 0.0f).scale.x;
}

/// A kernel of this library.
extern "C" __global__ void OwnKernel(SceneView scene, const Ray* rays, Hit* hits) {
  hits[0] = closest_hit(scene, rays[0]);
}
