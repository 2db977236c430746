#pragma once
/// The list of the kernels that are compiled in, and what they are started with.

#include "answer.h"
#include "variant.h"

#include <hiprt_device/filter.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/traverse/stacks/spill.h>

#include <vector>

namespace hiprt::bench {

/// The argument of every kernel.
struct GpuJob {
  SceneView scene;
  const void* rays;             ///< 32 bytes each: origin, tmin, direction, tmax.
  Answer* answers;              ///< As many as rays.
  std::uint32_t count;          ///< Rays.
  std::uint32_t* next;          ///< Zero; batch schedules only.
  StackEntry* spill;            ///< SpillUse::kGrid: spill_entries per thread of the grid.
  std::uint32_t spill_threads;  ///< Of the grid.
  std::uint32_t spill_entries;
  SpillPool pool;             ///< SpillUse::kPool.
  std::uint32_t* overflowed;  ///< Counts rays whose stack was too small.
  const Box* boxes;           ///< Custom primitives (BoxSet).
  ExceptPrimitive filter;     ///< No primitive at all: accepts everything, which the compiler cannot know.
  SceneView object;           ///< Of a scene that is one instance (PlacedObject), for GpuKernel::placed.
  std::uint32_t instance;
};

/// Which global memory a stack needs.
enum class SpillUse { kNone, kGrid, kPool };

struct GpuKernel {
  VariantName name;
  Query query;
  void (*kernel)(GpuJob);
  unsigned block;   ///< Threads of a block.
  bool persistent;  ///< The grid fills the device, rays are fetched.
  SpillUse spill;
  std::uint32_t on_chip;  ///< Entries of a thread that need no global memory.
  FeatureMask features;   ///< That a scene may have.
  unsigned levels;        ///< Of instances, that a scene may have.
  bool placed;            ///< For scenes that are one instance, and no others.
  bool ray_instruction;   ///< Empty on GPUs without that of amd_ray_test.h.
};

/// All kernels, in the order of the axes' values.
std::vector<GpuKernel> gpu_kernels();

}  // namespace hiprt::bench
