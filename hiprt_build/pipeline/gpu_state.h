#pragma once
/// What the kernels of the GPU builders share: blocks, boxes that many threads grow, and counts that only the device
/// knows. Internal.

#include <hiprt_build/encode/write_wide.h>
#include <hiprt_build/exec/wave_group.h>
#include <hiprt_build/presplit/split_demand.h>
#include <hiprt_device/math/atomic.h>

#include <bit>

namespace hiprt::build::kernels {

inline constexpr unsigned kBlock = 256;
/// Of kernels whose groups need shared memory.
inline constexpr unsigned kGroupBlock = 128, kGroupsPerBlock = kGroupBlock / WaveGroup::kLanes;
/// References of a block of pack_keys().
inline constexpr unsigned kPackRows = 8, kPackTile = kBlock * kPackRows;

inline __device__ std::uint32_t thread_index() { return blockIdx.x * blockDim.x + threadIdx.x; }

/// Floats as integers with the same order, for atomics.
HIPRT_HD inline std::uint32_t to_ordered(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}
HIPRT_HD inline float from_ordered(std::uint32_t ordered) {
  return std::bit_cast<float>((ordered & 0x80000000u) != 0 ? ordered & 0x7fffffffu : ~ordered);
}

/// A box that many threads grow.
struct SharedBox {
  std::uint32_t low[3], high[3];

  HIPRT_HD void clear() {
    for (unsigned axis = 0; axis < 3; ++axis) low[axis] = 0xffffffffu, high[axis] = 0;
  }
  HIPRT_HD bool empty() const { return low[0] == 0xffffffffu; }
  /// @pre not the empty box.
  HIPRT_HD void add(const Box& box) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      hiprt::lower(&low[axis], to_ordered(box.min[axis]));
      raise(&high[axis], to_ordered(box.max[axis]));
    }
  }
  HIPRT_HD Box get() const {
    Box box = empty_box();
    if (empty()) return box;
    for (unsigned axis = 0; axis < 3; ++axis) {
      box.min[axis] = from_ordered(low[axis]);
      box.max[axis] = from_ordered(high[axis]);
    }
    return box;
  }
};

/// Counts of primitives. dropped: by DropReason. singles: triangles that no window has paired.
struct GroupCounts {
  std::uint32_t leaves, pairs, customs, singles, dropped[4];
};

/// How far the writing of a wide tree is.
/// @tparam kApart bytes between counters: the atomics of many blocks to one line of a cache wait for each other.
template <std::size_t kApart> struct WideProgress {
  alignas(kApart) std::uint32_t queued;  ///< Tasks in the queue.
  alignas(kApart) std::uint32_t ticket;  ///< Next entry of the queue that no team has taken.
  // Where groups write subtrees alone:
  alignas(kApart) std::uint64_t queued_and_alone;  ///< In place of queued; << 32 the nodes that get no task there.
  alignas(kApart) std::uint32_t tasks;             ///< In the queue at its end; 0: not known yet.
};
/// Files with fewer nodes: caches hold what is read and written for them, in whatever order that is.
inline constexpr std::uint32_t kManyNodes = 1u << 19;

/// Of a whole grid.
using GridProgress = WideProgress<128>;

/// What a build knows while it runs.
struct BuildState {
  SharedBox bounds, centers;
  GroupCounts counts;
  std::uint32_t whole;  ///< Leaves before splits; kInvalidId if nothing is split.
  LinkedRef root;
  std::uint32_t nodes;       ///< Of the file.
  std::uint32_t bad_node;    ///< Of an imported tree; kInvalidId: none.
  std::uint32_t missing;     ///< Primitives that an imported tree has no leaf for.
  std::uint32_t too_deep;    ///< H-PLOC's tree: lbvh_again() makes another.
  std::uint32_t stack_need;  ///< Of a traversal of the file.
  SplitDemand demand;        ///< Of the leaves, where the plan measures it.
};

/// What the climbs need, in the order of the keys.
struct SortedLeaves {
  Reference* references;
  LeafPrimitives* primitives;
  std::uint8_t* levels;
  std::uint32_t* met;
};

}  // namespace hiprt::build::kernels
