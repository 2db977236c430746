#pragma once
/// Kernels that are compiled ahead of time with HIPRT's names.

#include <hip/hip_runtime.h>

#include <hiprt/hiprt_types.h>

namespace hiprt_api_test {

/// What a launch traces with, on the device.
struct Trace {
  const void* object;  ///< hiprtGeometry or hiprtScene.
  hiprtFuncTable table;
  const hiprtRay* rays;
  hiprtHit* hits;
  uint32_t count;
  uint32_t mask;
  float time;
};

/// Closest hits, triangles or custom primitives. Waits.
hipError_t trace_geometry(const Trace& trace);
hipError_t trace_scene(const Trace& trace);
/// Position of the object's point (0.3, 0.7, -0.2) in the world, for each hit.
hipError_t to_world(const Trace& trace, float* positions);

}  // namespace hiprt_api_test
