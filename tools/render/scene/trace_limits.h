#pragma once
/// Limits of the tracers of trace() and GpuTracer.

namespace hiprt::tools {

/// Most stack entries that a scene may need: 180 per tree of the builders, on kTraceLevels nested levels. A CPU touches
/// only the memory that a ray uses.
inline constexpr unsigned kTraceStack = 8192;

/// Most levels of instances. Scenes with no or one level have smaller tracers of their own.
inline constexpr unsigned kTraceLevels = 32;

/// Above this number of levels, and for moving instances, GpuTracer has the default tests only, because kernels compile
/// slowly.
inline constexpr unsigned kGpuChoiceLevels = 0;

}  // namespace hiprt::tools
