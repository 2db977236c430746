#pragma once
/// The nodes of a wide tree, written by teams of lanes that take tasks from a queue. Internal.

#include <hiprt_build/encode/write_wide.h>
#include <hiprt_build/exec/wave_group.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {

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

/// Teams take entries of the queue in order. An entry that is still empty will be filled by a team with an earlier
/// entry, which is running.
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
