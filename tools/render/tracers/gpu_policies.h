#pragma once
/// How rays are traced on each GPU architecture.

#include <hiprt_device/scene_view.h>
#include <hiprt_device/traverse/stacks/stack.h>

#include <array>
#include <cstdint>
#include <string_view>

namespace hiprt::tools {

enum class GpuStack {
  kPrivate,  ///< PrivateStack<kGpuPrivateStack>, or TieredStack: for trees whose stack bound fits.
  kRolling,  ///< RollingStack<kGpuRing> over global memory: for every tree.
};

/// Entries of the stacks. The builders' trees need 180 at most.
inline constexpr unsigned kGpuPrivateStack = 192;
inline constexpr unsigned kGpuRing = 8;

enum class GpuBoxes {
  kSlabs,           ///< In software, as TracePolicies say.
  kRayInstruction,  ///< HardwareBoxes (AMD), for files with widened boxes and the default TracePolicies.
};

/// WholeWave<fetch_below, search_above>. 0: Immediate.
struct GpuSchedule {
  unsigned fetch_below, search_above;
};

/// Entries of a TieredStack in shared memory, by levels of instances. 0: PrivateStack.
struct SharedEntries {
  unsigned flat, one_level, levels;
};

/// What the compiler makes room for in registers. NVIDIA: blocks per multiprocessor; AMD: waves per SIMD.
struct LeastResident {
  unsigned one_level;  ///< And without instances.
  unsigned levels;
  unsigned motion;  ///< Where instances move that hold triangles only.
};

struct GpuPolicy {
  std::string_view architectures;  ///< First letters of the architectures' names.
  GpuStack stack;
  GpuBoxes boxes;
  GpuSchedule schedule;
  GpuSchedule schedule_of_levels;  ///< Where there is more than one level of instances, and no motion.
  /// Whether one level's PathMemory are in shared memory; else in the thread's own.
  bool shared_paths;
  unsigned block;  ///< Threads of a block, a multiple of 64: waves are whole.
  SharedEntries shared_entries;
  LeastResident least_resident;
};

/// The first that fits and has a kernel is taken. sm_, private stack: measured on an H200 (sm_90). gfx: chosen by
/// counts of instructions (docs/PERFORMANCE_AMD.md), not measured. The others are not measured.
inline constexpr std::array<GpuPolicy, 5> kGpuPolicies{{
    {"gfx1", GpuStack::kPrivate, GpuBoxes::kRayInstruction, {0, 0}, {0, 0}, false, 64, {8, 8, 8}, {14, 14, 14}},
    {"gfx", GpuStack::kPrivate, GpuBoxes::kSlabs, {12, 4}, {12, 4}, false, 64, {8, 8, 8}, {1, 1, 1}},
    {"gfx", GpuStack::kRolling, GpuBoxes::kSlabs, {16, 4}, {16, 4}, false, 64, {0, 0, 0}, {1, 1, 1}},
    {"sm_", GpuStack::kPrivate, GpuBoxes::kSlabs, {12, 4}, {1, 0}, true, 64, {0, 16, 22}, {14, 12, 10}},
    {"sm_", GpuStack::kRolling, GpuBoxes::kSlabs, {12, 4}, {1, 0}, true, 64, {0, 0, 0}, {14, 12, 10}},
}};

/// Whether closest_hit(scene, ray) would use AMD's ray instruction there, too (kUsesRayInstruction).
constexpr bool uses_ray_instruction(std::string_view architecture) {
  for (const std::string_view family : {"gfx103", "gfx110", "gfx115"})
    if (architecture.starts_with(family)) return true;
  return false;
}

constexpr bool fits(const GpuPolicy& policy, std::string_view architecture, const SceneView& scene) {
  if (!architecture.starts_with(policy.architectures)) return false;
  if (policy.boxes == GpuBoxes::kRayInstruction && !(uses_ray_instruction(architecture) && scene.box_margin > 0.0f))
    return false;
  return policy.stack == GpuStack::kRolling || scene.stack_bound <= kGpuPrivateStack - kMostPushed;
}

/// @param architecture as gpu::Device has it.
/// @param has_kernel whether there is a kernel for an index of kGpuPolicies. Called for each that fits.
/// @return an index of kGpuPolicies, or its size if no policy fits.
template <class HasKernel>
constexpr std::size_t choose_gpu_policy(std::string_view architecture, const SceneView& scene, HasKernel&& has_kernel) {
  for (std::size_t i = 0; i < kGpuPolicies.size(); ++i)
    if (fits(kGpuPolicies[i], architecture, scene) && has_kernel(i)) return i;
  return kGpuPolicies.size();
}

}  // namespace hiprt::tools
