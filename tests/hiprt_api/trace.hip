#include <tests/hiprt_api/trace.h>

#include <hiprt/hiprt_device.h>

/// Every box is hit at its centre: t of the ray's nearest point. Type 5 refuses all.
HIPRT_DEVICE bool intersectFunc(uint32_t geomType, uint32_t, const hiprtFuncTableHeader& table, const hiprtRay&, void*,
                                hiprtHit& hit) {
  if (geomType == 5u) return false;
  float t = 7.0f;
  if (table.funcDataSets != nullptr && table.funcDataSets[geomType].intersectFuncData != nullptr)
    t = static_cast<const float*>(table.funcDataSets[geomType].intersectFuncData)[hit.primID];
  hit.t = t;
  hit.uv = hiprtFloat2{0.0f, 0.0f};
  hit.normal = hiprtFloat3{0.0f, 0.0f, 1.0f};
  return true;
}

/// Rejects the primitive whose number is the data.
HIPRT_DEVICE bool filterFunc(uint32_t geomType, uint32_t, const hiprtFuncTableHeader& table, const hiprtRay&, void*,
                             const hiprtHit& hit) {
  if (geomType >= table.numGeomTypes || table.funcDataSets[geomType].filterFuncData == nullptr) return false;
  return hit.primID == *static_cast<const uint32_t*>(table.funcDataSets[geomType].filterFuncData);
}

namespace hiprt_api_test {
namespace {

constexpr unsigned kBlock = 64;

__global__ void geometry_kernel(Trace trace) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= trace.count) return;
  hiprtGeomCustomTraversalClosest traversal(const_cast<void*>(trace.object), trace.rays[i], hiprtTraversalHintDefault,
                                            nullptr, trace.table);
  trace.hits[i] = traversal.getNextHit();
}

__global__ void scene_kernel(Trace trace) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= trace.count) return;
  hiprtSceneTraversalClosest traversal(const_cast<void*>(trace.object), trace.rays[i], trace.mask,
                                       hiprtTraversalHintDefault, nullptr, trace.table, 0, trace.time);
  trace.hits[i] = traversal.getNextHit();
}

__global__ void world_kernel(Trace trace, float* positions) {
  const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= trace.count || !trace.hits[i].hasHit()) return;
  const float3 point = hiprtPointObjectToWorld(float3{0.3f, 0.7f, -0.2f}, const_cast<void*>(trace.object),
                                               trace.hits[i].instanceIDs, trace.time);
  positions[3 * i] = point.x;
  positions[3 * i + 1] = point.y;
  positions[3 * i + 2] = point.z;
}

hipError_t finish() {
  const hipError_t launched = hipGetLastError();
  return launched != hipSuccess ? launched : hipDeviceSynchronize();
}

}  // namespace

hipError_t trace_geometry(const Trace& trace) {
  hipLaunchKernelGGL(geometry_kernel, dim3((trace.count + kBlock - 1) / kBlock), dim3(kBlock), 0, nullptr, trace);
  return finish();
}

hipError_t trace_scene(const Trace& trace) {
  hipLaunchKernelGGL(scene_kernel, dim3((trace.count + kBlock - 1) / kBlock), dim3(kBlock), 0, nullptr, trace);
  return finish();
}

hipError_t to_world(const Trace& trace, float* positions) {
  hipLaunchKernelGGL(world_kernel, dim3((trace.count + kBlock - 1) / kBlock), dim3(kBlock), 0, nullptr, trace,
                     positions);
  return finish();
}

}  // namespace hiprt_api_test
