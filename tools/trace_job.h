#pragma once
/// What tracer.cpp hands to the kernels of one instruction set: the function trace_NAME(job) of trace_kernels.cpp.
/// Plain members only: a container's inline function, compiled for a newer instruction set, could be the copy that the
/// linker keeps for the whole program.

#include "tracer.h"

#include <cstddef>

namespace hiprt::tools {

struct TraceJob {
  const SceneView* scene;
  Query query;
  TracePolicies policies;
  const Ray* rays;
  Hit* hits;
  RayCost* costs;  ///< nullptr: the work is not counted.
  std::size_t count;
};

/// Stack entries of the kernels: a tree of 1365 levels of full nodes. The memory is touched only as far as it is used.
inline constexpr unsigned kTraceStack = 4096;

}  // namespace hiprt::tools
