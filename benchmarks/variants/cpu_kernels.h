#pragma once
/// The variants on the CPU: queries, layouts, tests and features, for the machine's best instruction set. They also
/// compute the expected results.
///
/// Jobs have plain members only. A container's inline functions would be compiled for a newer instruction set, and the
/// linker could keep that copy for the whole program.

#include "ray_result.h"

#include <hiprt_device/scene_view.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::bench {

/// The most levels of instances.
inline constexpr unsigned kCpuLevels = 32;

struct CpuJob {
  const SceneView* scene;
  Query query;
  bool fast;         ///< Fast triangles and Plain boxes.
  unsigned levels;   ///< Of instances. 0: a tracer without instances; else one with instances and motion.
  const Box* boxes;  ///< Custom primitives (BoxSet); nullptr: a tracer without them.
  const Ray* rays;
  Hit* hits;           ///< One per ray, for Query::kClosest and kAny.
  RayResult* results;  ///< One per ray, for Query::kAll.
  std::size_t count;
};

/// Traces rays[i] into hits[i] or results[i] on the calling thread.
void run_on_cpu(const CpuJob& job);

/// Name of the instruction set that run_on_cpu() uses, e.g. "x86_64_v3".
const char* cpu_isa();

}  // namespace hiprt::bench
