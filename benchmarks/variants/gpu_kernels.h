#pragma once
/// The compiled kernels and the argument that they take.

#include "ray_result.h"
#include "variant.h"

#include <hiprt_device/filter.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/traverse/stacks/spill.h>

#include <vector>

namespace hiprt::bench {

/// The argument of every kernel.
struct GpuJob {
  SceneView scene;
  const void* rays;             ///< 32 bytes each: origin, tmin, direction, tmax. Of Answer::kHit: Ray.
  void* results;                ///< One per ray: RayResult. Of Answer::kHit: Hit.
  std::uint32_t count;          ///< Rays.
  std::uint32_t* next;          ///< The next ray to fetch, for batch schedules. Zero before a launch.
  StackEntry* spill;            ///< SpillUse::kGrid: spill_entries per thread of the grid.
  std::uint32_t spill_threads;  ///< Of the grid.
  std::uint32_t spill_entries;
  SpillPool pool;             ///< SpillUse::kPool.
  std::uint32_t* overflowed;  ///< Counts rays whose stack was too small.
  const Box* boxes;           ///< Custom primitives (BoxSet).
  ExceptPrimitive filter;     ///< Accepts every primitive. The compiler cannot know that.
  SceneView object;           ///< Object of a scene that is one instance (PlacedObject), for GpuKernel::placed.
  std::uint32_t instance;
};

/// Global memory that a stack needs: none, entries per thread of the grid, or slots that waves share.
enum class SpillUse { kNone, kGrid, kPool };

/// What a kernel reads and writes per ray.
enum class Answer {
  kId,   ///< The least: 32 bytes and RayResult.
  kHit,  ///< What programs have: Ray, and Hit with normal and error.
};

struct GpuKernel {
  VariantName name;
  Query query;
  Answer answer;
  void (*kernel)(GpuJob);
  unsigned block;   ///< Threads per block.
  bool persistent;  ///< The grid fills the device and fetches rays.
  SpillUse spill;
  std::uint32_t on_chip;  ///< Stack entries per thread that need no global memory.
  FeatureMask features;   ///< Features that a scene may have.
  unsigned levels;        ///< Levels of instances that a scene may have.
  bool placed;            ///< Traces scenes that are one instance, and no others.
  bool ray_instruction;   ///< Needs AMD's ray instruction (amd_ray_test.h). The kernel is empty on other GPUs.
};

/// All kernels, in the order of the axes' values.
std::vector<GpuKernel> gpu_kernels();

}  // namespace hiprt::bench
