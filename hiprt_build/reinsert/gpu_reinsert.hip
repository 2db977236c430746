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

struct Places {
  std::uint32_t looking;
  std::uint32_t* parents;
  std::uint32_t* met;
  Reinsertion* found = nullptr;
  ReinsertionBids* bids = nullptr;
  std::uint8_t* granted = nullptr;
  LinkedNode* before = nullptr;
  std::uint32_t* too_deep = nullptr;

  Places(Arena& arena, std::uint32_t room, unsigned rounds)
      : looking(Lookers::count(2 * room, Lookers::kUsualShift)),
        parents(arena.take<std::uint32_t>(2 * std::uint64_t{room})),
        met(arena.take<std::uint32_t>(room)) {
    if (rounds == 0) return;
    found = arena.take<Reinsertion>(looking);
    bids = arena.take<ReinsertionBids>(2 * std::uint64_t{room});
    granted = arena.take<std::uint8_t>(looking);
    before = arena.take<LinkedNode>(room);
    too_deep = arena.take<std::uint32_t>(1);
  }
};

}  // namespace

std::uint64_t finish_tree_scratch(std::uint32_t room, unsigned rounds) {
  Arena arena;
  Places(arena, room, rounds);
  return arena.size();
}

Result<void> enqueue_finish_tree(const TreeInput& input, std::byte* scratch, hipStream_t stream) {
  const std::uint32_t room = input.room;
  const PlannedTree& tree = input.tree;
  Arena arena(scratch);
  const Places places(arena, room, input.rounds);
  const ShapeTree shape{{tree.leaves, tree.nodes, {}, tree.root}, room, places.parents};
  Launcher steps(stream);
  steps.fill_bytes("parents", places.parents, 2 * std::uint64_t{room}, 0xff);
  steps.each(room, "set_parents", set_parents, shape);
  if (input.rounds != 0)
    steps.then([&] {
      return check(hipMemcpyAsync(places.before, tree.nodes, std::uint64_t{room} * sizeof(LinkedNode),
                                  hipMemcpyDeviceToDevice, stream),
                   "hipMemcpyAsync", "nodes");
    });
  for (unsigned round = 0; round < input.rounds; ++round) {
    const Lookers lookers{Lookers::kUsualShift, round % (1u << Lookers::kUsualShift)};
    steps.fill_bytes("bids", places.bids, 2 * std::uint64_t{room}, 0);
    steps.fill_bytes("arrivals", places.met, room, 0);
    steps.each(places.looking, "find_places", find_places, shape, lookers, places.looking, places.found);
    steps.each(places.looking, "bid_for_places", bid_for_places, shape, lookers, places.looking, places.found,
               places.bids);
    steps.each(places.looking, "grant_places", grant_places, shape, lookers, places.looking, places.found, places.bids,
               places.granted);
    steps.each(places.looking, "take_places", take_places, shape, lookers, places.looking, places.found,
               places.granted);
    if (round + 1 < input.rounds)
      steps.each(room, "refit_tree", refit_tree<build::NoSums>, shape.tree, room, places.parents, places.met);
  }
  if (input.rounds == 0) steps.fill_bytes("arrivals", places.met, room, 0);
  steps.each(room, "refit_tree", refit_tree<build::PlanSums>, tree, room, places.parents, places.met);
  if (input.rounds != 0) {
    steps.one("note_depth", note_depth, tree, places.too_deep);
    steps.each(room, "restore_nodes", restore_nodes, shape, places.before, places.met, places.too_deep);
    steps.each(room, "restore_parents", restore_parents, shape, places.too_deep);
    steps.each(room, "restore_plans", restore_plans, tree, room, places.parents, places.met, places.too_deep);
  }
  return steps.result();
}

}  // namespace hiprt::gpu
