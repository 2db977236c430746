#pragma once
/// The tracers, one function per precision. Each has a source file, which is compiled once per instruction set.

#include <hiprt_build/python/tracers/point_job.h>

namespace hiprt::python {
inline namespace HIPRT_ISA_NAMESPACE {

/// @pre of all: is_traceable(*job.scene) (tracers.h).
void trace_watertight(const TraceJob& job);
void trace_reference(const TraceJob& job);
void trace_double(const TraceJob& job);
/// @pre is_flat(*job.scene).
void trace_fast(const TraceJob& job);
/// @pre of both: has_only_triangles(*job.scene) too. @return false: a stack was too small.
bool find_points(const PointJob& job);
bool find_overlaps(const OverlapJob& job);

/// Whether a scene has triangles only, without instances, in layout planes.
inline bool is_flat(const SceneView& scene) {
  return scene.levels == 0 && scene.layout == NodeLayout::kPlanes &&
         (scene.features & feature_bit(Feature::kCustom)) == 0;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::python
