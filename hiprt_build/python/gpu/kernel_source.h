#pragma once
/// The kernels of queries, as text for the run-time compiler.

#include <hiprt_build/python/tracers/job.h>

#include <string>

namespace hiprt::python::gpu {

enum class Answer { kCast, kOccluded, kCount, kPoint };

/// Name of the kernel in each source.
inline constexpr const char* kKernel = "hiprt_query";
/// Threads of a block.
inline constexpr unsigned kBlockThreads = 128;
/// Most stack entries that a scene may need on a GPU, which reserves the memory of all threads that it can hold:
/// 8 bytes per entry and thread.
inline constexpr unsigned kMostGpuEntries = 2048;

struct KernelSource {
  std::string text;
  /// Whether the compiler may fuse products and sums. All triangle tests but Fast have the same bits either way, and
  /// boxes are faster with it.
  bool fuses;
};

/// The source for a scene's features, levels, layout and stack: the kernel has code for no more than these.
/// @param precision of rays; of points kDouble or another one.
KernelSource kernel_source(const SceneView& scene, Answer answer, Precision precision);

}  // namespace hiprt::python::gpu
