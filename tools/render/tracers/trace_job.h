#pragma once
/// What tracer.cpp hands to the kernels of one instruction set: the function trace_NAME(job) of trace_kernels.cpp.
/// Plain members only: a container's inline function, compiled for a newer instruction set, could be the copy that the
/// linker keeps for the whole program.

#include <tools/render/tracers/tracer.h>

#include <cstddef>

namespace hiprt::tools {

struct TraceJob {
  const SceneView* scene;
  Query query;
  TracePolicies policies;
  const Ray* rays;
  Hit* hits;
  RayCost* costs;        ///< nullptr: the work is not counted.
  std::uint32_t* paths;  ///< scene->levels entries per ray. nullptr: paths are not stored.
  std::size_t count;
  /// Scene whose materials cut out parts of triangles (AlphaCutout); then the policies are the default ones. nullptr:
  /// no material does.
  const PathScene* cutout_scene;
  StepSink sink;  ///< Without `take` no steps are reported. With it work is counted.
};

}  // namespace hiprt::tools
