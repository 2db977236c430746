#pragma once
/// What the tracers of trace() and GpuTracer are compiled for.

namespace hiprt::tools {

/// Stack entries that a scene may need: those of the builders' trees, 180 at most, on kTraceLevels levels, one in the
/// other. A CPU's memory is touched only as far as it is used.
inline constexpr unsigned kTraceStack = 8192;

/// Levels of instances that a scene may have. Scenes without any, and with one, have smaller tracers of their own.
inline constexpr unsigned kTraceLevels = 32;

/// Above this many levels, and where instances move, GpuTracer has the default tests only: kernels take long to
/// compile.
inline constexpr unsigned kGpuChoiceLevels = 0;

}  // namespace hiprt::tools
