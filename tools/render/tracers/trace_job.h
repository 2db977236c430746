#pragma once
/// What tracer.cpp hands to the kernels of one instruction set: the function trace_NAME(job) of trace_kernels.cpp.
/// Plain members only: a container's inline function, compiled for a newer instruction set, could be the copy that the
/// linker keeps for the whole program.

#include <tools/render/scene/path_scene.h>
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
  std::uint32_t* paths;  ///< scene->levels per ray; nullptr: nobody asks.
  std::size_t count;
  const PathScene*
      cutout_scene;  ///< Whose materials have some (CutOut); nullptr: nobody asks. Then policies are the default.
  StepSink sink;     ///< Without take: nobody asks. With it costs are counted.
};

}  // namespace hiprt::tools
