#pragma once
/// What the kernels of the GPU builders share: counts that only the device knows, and the writing of wide trees.
/// Internal.

#include <hiprt_build/encode/write_wide.h>
#include <hiprt_build/exec/wave_group.h>
#include <hiprt_build/lbvh_ploc/hploc.h>
#include <hiprt_build/lbvh_ploc/lbvh.h>
#include <hiprt_build/lbvh_ploc/morton.h>
#include <hiprt_build/pair/edge_table.h>
#include <hiprt_build/pair/pair_window.h>

#include <bit>

namespace hiprt::build::kernels {

inline constexpr unsigned kBlock = 256;
/// Of kernels whose groups need shared memory.
inline constexpr unsigned kGroupBlock = 128, kGroupsPerBlock = kGroupBlock / WaveGroup::kLanes;

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

/// Counts of primitives: [DropReason] for those that are dropped; singles: triangles that no window has paired.
struct GroupCounts {
  std::uint32_t leaves, pairs, customs, singles, dropped[4];
};

/// How far the writing of a wide tree is.
struct WideProgress {
  std::uint32_t queued, ticket, stack_need;
};

/// What a build knows while it runs.
struct BuildState {
  SharedBox bounds, centers;
  GroupCounts counts;
  std::uint32_t whole;  ///< Leaves before there were cuts; kInvalidId where there are none.
  LinkedRef root;
  std::uint32_t too_deep;  ///< H-PLOC's tree: lbvh_again() makes another.
  WideProgress wide;
};

/// What the climbs need, in the order of the keys.
struct SortedLeaves {
  Reference* references;
  LeafPrimitives* primitives;
  std::uint8_t* levels;
  std::uint32_t* met;
};

using PlannedTree = LinkedTree<ReferenceLeaves, PlanSums>;

/// Clears entry i of the queue; the root's has its task. A tree of one run is written.
template <class Layout>
__device__ void begin_wide(const WideWriter<Layout>& writer, const WideQueue& queue, LinkedRef root, std::uint32_t i,
                           WideProgress& progress) {
  if (writer.is_run(root)) {
    Box box;
    if (i == 0) writer.write_run(root, 0, box);
  } else if (i == 0) {
    writer.post_task(0, root, 1, 0, 0);
    queue.write(0, 0);
    progress.queued = 1;
  } else if (i < writer.plans[root].nodes) {
    queue.clear(i);
  }
}

/// Teams take places in the queue. Who waits for an entry waits for a team that is running: one with an earlier place.
template <class Layout>
__device__ void write_wide(const WideWriter<Layout>& writer, const WideQueue& queue, LinkedRef root,
                           WideProgress& progress) {
  const std::uint32_t nodes = writer.is_run(root) ? 0 : writer.plans[root].nodes;
  const WaveGroup group;
  const LaneTeam team;
  constexpr unsigned kTeams = WaveGroup::kLanes / LaneTeam::kLanes;
  for (;;) {
    std::uint32_t first = group.lane() == 0 ? fetch_add(&progress.ticket, kTeams) : 0;
    first = group.from(0, first);
    if (first >= nodes) return;
    const std::uint32_t mine = first + group.lane() / LaneTeam::kLanes;
    bool waits = mine < nodes;
    while (group.any(waits)) {
      std::uint32_t node = kInvalidId;
      if (waits && team.lane() == 0) node = queue.read(mine);
      node = team.from(0, node);
      typename WideWriter<Layout>::Part part{};
      part.node = kInvalidId;
      if (node != kInvalidId) part = writer.open(team, writer.read_task(team, node));
      // Others can go on with the children before this team writes.
      const std::uint32_t children = group.ballot(part.node != kInvalidId);
      if (children != 0) {
        finish_writes();
        std::uint32_t to = group.lane() == 0 ? fetch_add(&progress.queued, lane_count(children)) : 0;
        to = group.from(0, to) + lane_count(children & ((1u << group.lane()) - 1));
        if (part.node != kInvalidId) queue.write(to, part.node);
      }
      if (node == kInvalidId) continue;
      writer.write(node, team.lane(), part);
      if (team.lane() == 0 && part.need > progress.stack_need) raise(&progress.stack_need, part.need);
      waits = false;
    }
  }
}

}  // namespace hiprt::build::kernels
