#pragma once
/// The variants on the CPU: queries, layouts, tests and features, with the machine's best instruction set. They also
/// say what the right answers are.
///
/// Plain members only: a container's inline function, compiled for a newer instruction set, could be the copy that the
/// linker keeps for the whole program.

#include "answer.h"

#include <hiprt_device/scene_view.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::bench {

/// The most levels of instances.
inline constexpr unsigned kCpuLevels = 32;

struct CpuJob {
  const SceneView* scene;
  Query query;
  bool fast;         ///< Fast triangles and Plain boxes.
  unsigned levels;   ///< Of instances; 0: a tracer without them, else of what moves too.
  const Box* boxes;  ///< Custom primitives (BoxSet); nullptr: a tracer without them.
  const Ray* rays;
  Hit* hits;        ///< As many as rays; of Query::kClosest and kAny.
  Answer* answers;  ///< As many as rays; of Query::kAll.
  std::size_t count;
};

/// Traces rays[i] into hits[i] or answers[i] on the calling thread.
void run_on_cpu(const CpuJob& job);

/// Name of the instruction set that run_on_cpu() uses, e.g. "x86_64_v3".
const char* cpu_isa();

}  // namespace hiprt::bench
