#pragma once
/// How rays are traced on each GPU architecture.

#include <hiprt_device/traverse/stacks/stack.h>

#include <array>
#include <cstdint>
#include <string_view>

namespace hiprt::tools {

enum class GpuStack {
  kPrivate,  ///< PrivateStack<kGpuPrivateStack>, with instances TieredStack: for trees whose stack bound fits.
  kRolling,  ///< RollingStack<kGpuRing> over global memory: for every tree.
};

/// Entries of the stacks. The builders' trees need 180 at most.
inline constexpr unsigned kGpuPrivateStack = 192;
inline constexpr unsigned kGpuRing = 8;

/// WholeWave<fetch_below, search_above>.
struct GpuSchedule {
  unsigned fetch_below, search_above;
};

struct GpuPolicy {
  std::string_view architectures;  ///< First letters of the architectures' names.
  GpuStack stack;
  GpuSchedule schedule;
  GpuSchedule schedule_of_levels;  ///< Where there is more than one level of instances, and no motion.
  /// Whether one level's PathMemory are in shared memory; else in the thread's own.
  bool shared_paths;
  unsigned block;  ///< Threads of a block, a multiple of 64: waves are whole.
  /// Entries of a TieredStack in shared memory: of one level, and of more.
  unsigned shared_entries, shared_entries_of_levels;
  /// What the compiler makes room for in registers. NVIDIA: blocks per multiprocessor; AMD: waves per SIMD.
  unsigned min_blocks;
  unsigned min_blocks_of_levels;  ///< The same where there is more than one level of instances.
  unsigned min_blocks_of_motion;  ///< Where instances move that hold triangles only.
};

/// The first that fits is taken. sm_, private stack: measured on an H200 (sm_90). The others are not measured.
inline constexpr std::array<GpuPolicy, 3> kGpuPolicies{{
    {"gfx", GpuStack::kRolling, {16, 4}, {16, 4}, false, 64, 0, 0, 1, 1, 1},
    {"sm_", GpuStack::kPrivate, {12, 4}, {1, 0}, true, 64, 16, 22, 14, 12, 10},
    {"sm_", GpuStack::kRolling, {12, 4}, {1, 0}, true, 64, 0, 0, 14, 12, 10},
}};

constexpr bool fits(const GpuPolicy& policy, std::uint32_t stack_bound) {
  return policy.stack == GpuStack::kRolling || stack_bound <= kGpuPrivateStack - kMostPushed;
}

/// @param architecture as gpu::Device has it.
/// @return an index of kGpuPolicies, or its size if no policy fits.
constexpr std::size_t choose_gpu_policy(std::string_view architecture, std::uint32_t stack_bound) {
  for (std::size_t i = 0; i < kGpuPolicies.size(); ++i)
    if (architecture.starts_with(kGpuPolicies[i].architectures) && fits(kGpuPolicies[i], stack_bound)) return i;
  return kGpuPolicies.size();
}

}  // namespace hiprt::tools
