#include <hiprt_build/reinsert/gpu_reinsert.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/reinsert/gpu_reinsert_kernels.h>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Lookers;
using build::Reinsertion;
using build::ReinsertionBids;

struct ReinsertScratch {
  std::uint32_t subtrees, looking;
  std::uint32_t* parents;
  ReinsertionBids* bids = nullptr;
  std::uint32_t* met;  ///< Behind the bids, so that one call clears both.
  Reinsertion* found = nullptr;
  std::uint8_t* granted = nullptr;
  NodeLinks* before = nullptr;
  std::uint32_t *height = nullptr, *most_rounds = nullptr, *too_deep = nullptr;

  ReinsertScratch(Arena& arena, std::uint32_t capacity, unsigned rounds)
      : subtrees(2 * (capacity + TreeSize::kRoom)),
        looking(Lookers::count(subtrees, Lookers::kUsualShift)),
        parents(arena.take<std::uint32_t>(subtrees)) {
    if (rounds != 0) bids = arena.take<ReinsertionBids>(subtrees);
    met = arena.take<std::uint32_t>(capacity);
    if (rounds == 0) return;
    found = arena.take<Reinsertion>(looking);
    granted = arena.take<std::uint8_t>(looking);
    before = arena.take<NodeLinks>(capacity);
    height = arena.take<std::uint32_t>(1);
    most_rounds = arena.take<std::uint32_t>(1);
    too_deep = arena.take<std::uint32_t>(1);
  }

  /// Clears the bids and what RefitStep needs.
  void clear(Launcher& steps, std::uint32_t capacity) const {
    std::byte* const begin = bids != nullptr ? reinterpret_cast<std::byte*>(bids) : reinterpret_cast<std::byte*>(met);
    const auto bytes = reinterpret_cast<std::byte*>(met + capacity) - begin;
    steps.fill_bytes("bids", begin, static_cast<std::uint64_t>(bytes), 0);
  }
};

}  // namespace

std::uint64_t finish_tree_scratch(std::uint32_t capacity, unsigned rounds) {
  Arena arena;
  ReinsertScratch(arena, capacity, rounds);
  return arena.size();
}

Result<void> enqueue_finish_tree(const TreeInput& input, std::byte* memory, hipStream_t stream, LongStep asks) {
  const std::uint32_t capacity = input.capacity;
  const build::PlannedTree& tree = input.tree;
  Arena arena(memory);
  const ReinsertScratch scratch(arena, capacity, input.rounds);
  const TreeSize size{capacity, input.leaves};
  const ShapeTree shape{{tree.leaves, tree.nodes, {}, tree.root},
                        size,
                        scratch.parents,
                        scratch.height,
                        scratch.most_rounds,
                        input.most_height};
  Launcher steps(stream);
  steps.fill_bytes("parents", scratch.parents, scratch.subtrees, 0xff);
  steps.each(capacity, "set_parents", set_parents, shape);
  if (input.rounds != 0)
    steps.each(capacity, "start_rounds", start_rounds, shape, scratch.before, input.rounds, input.references);
  for (unsigned round = 0; round < input.rounds; ++round) {
    const Lookers lookers{Lookers::kUsualShift, round % (1u << Lookers::kUsualShift)};
    scratch.clear(steps, capacity);
    steps.each(scratch.looking, "find_reinsertions", find_reinsertions, shape, round, lookers, scratch.looking,
               scratch.found);
    steps.each(scratch.looking, "bid_for_reinsertions", bid_for_reinsertions, shape, lookers, scratch.looking,
               scratch.found, scratch.bids);
    steps.each(scratch.looking, "grant_reinsertions", grant_reinsertions, shape, lookers, scratch.looking,
               scratch.found, scratch.bids, scratch.granted);
    steps.each(scratch.looking, "apply_reinsertions", apply_reinsertions, shape, lookers, scratch.looking,
               scratch.found, scratch.granted);
    if (round + 1 == input.rounds) break;
    steps.each(capacity, "refit_round", refit_round, shape, round, scratch.met);
    steps.then([&] { return asks.done(stream, capacity, (round + 1.0) / input.rounds); });
  }
  if (input.rounds == 0) scratch.clear(steps, capacity);
  steps.each(capacity, "refit_tree", refit_tree, tree, size, scratch.parents, scratch.met);
  if (input.rounds != 0) {
    steps.one("note_depth", note_depth, tree, scratch.too_deep);
    steps.each(capacity, "restore_links", restore_links, shape, scratch.before, scratch.met, scratch.too_deep);
    steps.each(capacity, "restore_parents", restore_parents, shape, scratch.too_deep);
    steps.each(capacity, "restore_plans", restore_plans, tree, size, scratch.parents, scratch.met, scratch.too_deep);
  }
  return steps.result();
}

}  // namespace hiprt::gpu
