#pragma once
/// The nodes of a wide tree, written by teams of lanes that take tasks from a queue. Internal.

#include <hiprt_build/encode/write_wide.h>
#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/exec/wave_group.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::build::kernels {

/// A group of teams writes subtrees of so many nodes or fewer alone. So in large trees a node is written soon before
/// the nodes below it, and caches serve what they share. The queue's order alone puts them far apart.
/// @tparam kAlone the result for trees of @p many_nodes or more.
template <unsigned kAlone> HIPRT_HD constexpr std::uint32_t most_alone(std::uint32_t nodes, std::uint32_t many_nodes) {
  return nodes <= kAlone || nodes < many_nodes ? 1 : kAlone;
}

/// Clears entry i of the queue; the root's has its task. A tree of one run is written.
template <class Layout, class Progress>
__device__ void begin_wide(const WideWriter<Layout>& writer, const WideQueue& queue, LinkedRef root, std::uint32_t i,
                           Progress& progress) {
  if (writer.is_run(root)) {
    Box box;
    if (i == 0) writer.write_run(root, 0, box);
  } else if (i == 0) {
    writer.post_task(0, WideTask::make(root, 1, 0, 0));
    queue.write(0, 0);
    progress = Progress{1, 0, 1, 0};
  } else if (i < writer.plans[root].nodes) {
    queue.clear(i);
  }
}

/// The tasks of the subtrees that a group writes alone: one for each node but their roots. In shared memory.
template <unsigned kAlone> class OwnTasks {
 public:
  static constexpr unsigned kTeams = WaveGroup::kLanes / LaneTeam::kLanes;

  __device__ void put(std::uint32_t i, const WideTask& task, std::uint32_t node) {
    tasks_[i] = task;
    nodes_[i] = node;
  }
  __device__ WideTask task(std::uint32_t i) const { return tasks_[i]; }
  __device__ std::uint32_t node(std::uint32_t i) const { return nodes_[i]; }

 private:
  static constexpr unsigned kMost = kAlone > 1 ? kTeams*(kAlone - 1) : 1;

  WideTask tasks_[kMost];
  std::uint32_t nodes_[kMost];
};

/// A group of teams. Each team waits for an entry of the queue or takes one of the group's own tasks. Teams take
/// entries in order. An entry that is still empty will be filled by a team with an earlier entry, which is running.
template <unsigned kAlone, class Layout, class Progress> class WideTeams {
  using Part = typename WideWriter<Layout>::Part;

 public:
  __device__ WideTeams(const WideWriter<Layout>& writer, const WideQueue& queue, std::uint32_t nodes,
                       std::uint32_t many_nodes, Progress& progress, std::uint32_t& stack_need, OwnTasks<kAlone>& own)
      : writer_(writer),
        queue_(queue),
        progress_(progress),
        stack_need_(stack_need),
        own_(own),
        nodes_(nodes),
        most_alone_(kAlone > 1 ? most_alone<kAlone>(nodes, many_nodes) : 1) {}

  __device__ void run() {
    for (;;) {
      if (taken_ == listed_ && !group_.any(waits_)) {
        if (ended_) return;
        take_tickets();
      }
      // Two groups of one wave can wait for each other. So a group that has no task now goes the same way.
      WideTask task{};
      const std::uint32_t node = find_task(task);
      const bool mine = node != kInvalidId;
      if constexpr (kAlone > 1)
        if (!group_.any(mine)) find_end();
      Part part{};
      part.node = kInvalidId;
      bool alone = false;
      if (mine) {
        alone = most_alone_ > 1 && writer_.plans[task.ref()].nodes <= most_alone_;
        part = writer_.open(team_, task);
      }
      // Others can go on with the children before this team writes.
      post(part, alone);
      if (mine) writer_.write(node, team_.lane(), part);
      if (mine && team_.lane() == 0 && part.need > stack_need_) raise(&stack_need_, part.need);
    }
  }

 private:
  __device__ std::uint32_t lower_lanes() const { return (1u << group_.lane()) - 1; }

  /// One for each team.
  __device__ void take_tickets() {
    const std::uint32_t first = group_.lane() == 0 ? fetch_add(&progress_.ticket, OwnTasks<kAlone>::kTeams) : 0;
    ticket_ = group_.from(0, first) + group_.lane() / LaneTeam::kLanes;
    taken_ = listed_ = 0;
    waits_ = ticket_ < nodes_;
    ended_ = group_.any(!waits_);
  }

  /// @return the team's node, or kInvalidId: it has no task now.
  __device__ std::uint32_t find_task(WideTask& task) {
    std::uint32_t node = waits_ && team_.lane() == 0 ? queue_.read(ticket_) : kInvalidId;
    node = team_.from(0, node);
    const bool queued = node != kInvalidId;
    std::uint32_t others = 0, mine = 0;
    if constexpr (kAlone > 1) {
      others = group_.ballot(!queued && team_.lane() == 0);
      mine = taken_ + lane_count(others & ((1u << (group_.lane() - team_.lane())) - 1));
    }
    if (queued) {
      task = writer_.read_task(team_, node);
      waits_ = false;
    } else if (mine < listed_) {
      task = own_.task(mine);
      node = own_.node(mine);
    }
    const std::uint32_t taken = taken_ + lane_count(others);
    taken_ = taken < listed_ ? taken : listed_;
    return node;
  }

  /// Where groups have tasks of their own, the queue ends before it has an entry for each node.
  __device__ void find_end() {
    if (most_alone_ == 1) return;
    const std::uint32_t tasks = group_.from(0, group_.lane() == 0 ? load_shared(&progress_.tasks) : 0);
    const bool is_behind = tasks != 0 && ticket_ >= tasks;
    if (is_behind) waits_ = false;
    ended_ = group_.any(is_behind) || ended_;
  }

  /// The tasks of a team's children: for the group alone, or for all.
  __device__ void post(const Part& part, bool alone) {
    const bool is_node = part.node != kInvalidId, is_queued = is_node && !alone;
    const std::uint32_t queued = group_.ballot(is_queued);
    const WideTask task = WideTask::make(part.ref, part.next, part.leaf, part.need);
    if constexpr (kAlone > 1) {
      const std::uint32_t own = group_.ballot(is_node && alone);
      // All have read their tasks.
      group_.sync();
      if (is_node && alone) own_.put(listed_ + lane_count(own & lower_lanes()), task, part.node);
      listed_ += lane_count(own);
    }
    if (queued != 0) {
      if (is_queued) writer_.post_task(part.node, task);
      // Of the nodes below those, groups have tasks of their own.
      std::uint32_t below = 0;
      if (most_alone_ > 1) group_scan(group_, is_queued && part.below < most_alone_ ? part.below : 0, below);
      finish_writes();
      const std::uint32_t first = reserve(lane_count(queued), below);
      if (is_queued) queue_.write(first + lane_count(queued & lower_lanes()), part.node);
    }
    if constexpr (kAlone > 1) group_.sync();
  }

  /// Entries of the queue. @param below nodes that get none. @return the first.
  __device__ std::uint32_t reserve(std::uint32_t entries, std::uint32_t below) {
    if (most_alone_ == 1) return group_.from(0, group_.lane() == 0 ? fetch_add(&progress_.queued, entries) : 0);
    std::uint32_t first = 0;
    if (group_.lane() == 0) {
      const std::uint64_t before = fetch_add(&progress_.queued_and_alone, std::uint64_t{below} << 32 | entries);
      first = static_cast<std::uint32_t>(before);
      const std::uint32_t tasks = first + entries;
      if (tasks + static_cast<std::uint32_t>(before >> 32) + below == nodes_) store_shared(&progress_.tasks, tasks);
    }
    return group_.from(0, first);
  }

  const WideWriter<Layout>& writer_;
  const WideQueue& queue_;
  Progress& progress_;
  std::uint32_t& stack_need_;
  OwnTasks<kAlone>& own_;
  const WaveGroup group_;
  const LaneTeam team_;
  const std::uint32_t nodes_, most_alone_;
  std::uint32_t ticket_ = 0;
  std::uint32_t taken_ = 0, listed_ = 0;  // Of the group's own tasks.
  bool waits_ = false, ended_ = false;
};

/// @param many_nodes in large trees. @param stack_need becomes the most entries that a traversal can have, if it is
/// less.
template <unsigned kAlone, class Layout, class Progress>
__device__ void write_wide(const WideWriter<Layout>& writer, const WideQueue& queue, LinkedRef root,
                           std::uint32_t many_nodes, Progress& progress, std::uint32_t& stack_need,
                           OwnTasks<kAlone>& own) {
  if (writer.is_run(root)) return;
  const std::uint32_t nodes = writer.plans[root].nodes;
  WideTeams<kAlone, Layout, Progress>(writer, queue, nodes, many_nodes, progress, stack_need, own).run();
}

}  // namespace hiprt::build::kernels
