#pragma once
/// The CPU's tracers: one function per kind of scene. Each is compiled once per instruction set, in a source of its
/// own (trace_kernels_*.cpp).
///
/// kLevels is the largest number of levels of instances, kMoves says whether instances may move. The tracers with
/// kMoves are the general ones: they also count work and report steps for scenes of instances.

#include <tools/render/tracers/trace_job.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// Triangles, with every combination of tests except Reference.
/// @pre the job asks for costs only if kLevels is 0 or kMoves is true, and for steps only if kMoves is true.
template <unsigned kLevels, bool kMoves = false> void trace_levels(const TraceJob& job);

/// Conservative boxes, and any triangle test and primitives.
/// @pre the job asks for costs and steps only if kMoves is true.
template <unsigned kLevels, bool kMoves, class Triangle, class Primitives> void trace_accurate(const TraceJob& job);

/// The default policies. Rays pass through the parts of triangles that a material cuts out (AlphaCutout).
/// @pre the job asks neither for costs nor for steps. The scene has spheres or curves only if kMoves is true.
template <unsigned kLevels, bool kMoves> void trace_alpha_cutout(const TraceJob& job);

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
