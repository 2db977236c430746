#pragma once
/// Traces rays, points and boxes on the host with policies that are chosen at run time, by the machine's best
/// instruction set.

#include <hiprt_build/python/tracers/point_job.h>

namespace hiprt::python {

/// Traces the rays of a job on the calling thread.
/// @pre is_traceable(*job.scene).
void trace(const TraceJob& job);

/// Finds the points of a job on the calling thread.
/// @pre is_traceable(*job.scene) && has_only_triangles(*job.scene).
/// @return false: a stack was too small.
bool find(const PointJob& job);
/// The same for overlaps.
bool find(const OverlapJob& job);

/// Whether points and boxes can be asked of a scene: it has no custom primitives.
bool has_only_triangles(const SceneView& scene);

/// Whether trace() covers a scene: its levels, its stack, and the shapes of its custom primitives.
bool is_traceable(const SceneView& scene);

/// Name of the instruction set that trace() uses on this machine, for example "x86_64_v3".
const char* trace_isa();

}  // namespace hiprt::python
