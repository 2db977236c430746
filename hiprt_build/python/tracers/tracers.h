#pragma once
/// Traces rays on the host with policies that are chosen at run time, by the machine's best instruction set.

#include <hiprt_build/python/tracers/job.h>

namespace hiprt::python {

/// Traces the rays of a job on the calling thread.
/// @pre is_traceable(*job.scene).
void trace(const TraceJob& job);

/// Whether trace() covers a scene: its levels, its stack, and the shapes of its custom primitives.
bool is_traceable(const SceneView& scene);

/// Name of the instruction set that trace() uses on this machine, for example "x86_64_v3".
const char* trace_isa();

}  // namespace hiprt::python
