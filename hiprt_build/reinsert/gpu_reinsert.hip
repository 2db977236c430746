#include <hiprt_build/reinsert/gpu_reinsert.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/reinsert/gpu_reinsert_kernels.h>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::LinkedNode;
using build::Lookers;
using build::Reinsertion;
using build::ReinsertionBids;

struct ReinsertScratch {
  std::uint32_t looking;
  std::uint32_t* parents;
  std::uint32_t* met;
  Reinsertion* found = nullptr;
  ReinsertionBids* bids = nullptr;
  std::uint8_t* granted = nullptr;
  LinkedNode* before = nullptr;
  std::uint32_t* too_deep = nullptr;

  ReinsertScratch(Arena& arena, std::uint32_t capacity, unsigned rounds)
      : looking(Lookers::count(2 * capacity, Lookers::kUsualShift)),
        parents(arena.take<std::uint32_t>(2 * std::uint64_t{capacity})),
        met(arena.take<std::uint32_t>(capacity)) {
    if (rounds == 0) return;
    found = arena.take<Reinsertion>(looking);
    bids = arena.take<ReinsertionBids>(2 * std::uint64_t{capacity});
    granted = arena.take<std::uint8_t>(looking);
    before = arena.take<LinkedNode>(capacity);
    too_deep = arena.take<std::uint32_t>(1);
  }
};

}  // namespace

std::uint64_t finish_tree_scratch(std::uint32_t capacity, unsigned rounds) {
  Arena arena;
  ReinsertScratch(arena, capacity, rounds);
  return arena.size();
}

Result<void> enqueue_finish_tree(const TreeInput& input, std::byte* memory, hipStream_t stream) {
  const std::uint32_t capacity = input.capacity;
  const PlannedTree& tree = input.tree;
  Arena arena(memory);
  const ReinsertScratch scratch(arena, capacity, input.rounds);
  const ShapeTree shape{{tree.leaves, tree.nodes, {}, tree.root}, capacity, scratch.parents};
  Launcher steps(stream);
  steps.fill_bytes("parents", scratch.parents, 2 * std::uint64_t{capacity}, 0xff);
  steps.each(capacity, "set_parents", set_parents, shape);
  if (input.rounds != 0)
    steps.then([&] {
      return check(hipMemcpyAsync(scratch.before, tree.nodes, std::uint64_t{capacity} * sizeof(LinkedNode),
                                  hipMemcpyDeviceToDevice, stream),
                   "hipMemcpyAsync", "nodes");
    });
  for (unsigned round = 0; round < input.rounds; ++round) {
    const Lookers lookers{Lookers::kUsualShift, round % (1u << Lookers::kUsualShift)};
    steps.fill_bytes("bids", scratch.bids, 2 * std::uint64_t{capacity}, 0);
    steps.fill_bytes("arrivals", scratch.met, capacity, 0);
    steps.each(scratch.looking, "find_reinsertions", find_reinsertions, shape, lookers, scratch.looking, scratch.found);
    steps.each(scratch.looking, "bid_for_reinsertions", bid_for_reinsertions, shape, lookers, scratch.looking,
               scratch.found, scratch.bids);
    steps.each(scratch.looking, "grant_reinsertions", grant_reinsertions, shape, lookers, scratch.looking,
               scratch.found, scratch.bids, scratch.granted);
    steps.each(scratch.looking, "apply_reinsertions", apply_reinsertions, shape, lookers, scratch.looking,
               scratch.found, scratch.granted);
    if (round + 1 < input.rounds)
      steps.each(capacity, "refit_tree", refit_tree<build::NoSums>, shape.tree, capacity, scratch.parents, scratch.met);
  }
  if (input.rounds == 0) steps.fill_bytes("arrivals", scratch.met, capacity, 0);
  steps.each(capacity, "refit_tree", refit_tree<build::PlanSums>, tree, capacity, scratch.parents, scratch.met);
  if (input.rounds != 0) {
    steps.one("note_depth", note_depth, tree, scratch.too_deep);
    steps.each(capacity, "restore_nodes", restore_nodes, shape, scratch.before, scratch.met, scratch.too_deep);
    steps.each(capacity, "restore_parents", restore_parents, shape, scratch.too_deep);
    steps.each(capacity, "restore_plans", restore_plans, tree, capacity, scratch.parents, scratch.met,
               scratch.too_deep);
  }
  return steps.result();
}

}  // namespace hiprt::gpu
