#pragma once
/// Rounds of reinsertion over a linked tree. Internal.

#include <hiprt_build/reinsert/reinsert_steps.h>

#include <algorithm>

namespace hiprt::build {

/// Moves subtrees to better positions, round after round, and updates boxes and counts.
/// @param tree with boxes and counts; parents are set here.
template <class Engine, class Tree> void reinsert(Engine& engine, const ParentedTree<Tree>& tree, unsigned rounds) {
  const std::size_t leaves = tree.leaves;
  if (leaves < 3) return;
  const std::size_t looking = Lookers::count(2 * tree.leaves, Lookers::kUsualShift);
  auto found = engine.template allocate<Reinsertion>(looking);
  auto bids = engine.template allocate<ReinsertionBids>(2 * leaves);
  auto granted = engine.template allocate<std::uint8_t>(looking);
  auto met = engine.template allocate<std::uint32_t>(leaves);
  tree.parent(*tree.tree.root) = kInvalidId;
  engine.for_each(leaves - 1, SetParentsStep<Tree>{tree});
  std::uint32_t height = 0;
  for (unsigned round = 0; round < rounds && height <= kMostReinsertionHeight; ++round) {
    engine.fill(bids.span(), ReinsertionBids{0, 0});
    engine.fill(met.span(), 0u);
    const Lookers lookers{Lookers::kUsualShift, round % (1u << Lookers::kUsualShift)};
    engine.for_each(looking, FindReinsertionStep<Tree>{tree, lookers, found.data()});
    engine.for_each(looking, BidReinsertionStep<Tree>{tree, lookers, found.data(), bids.data()});
    engine.for_each(looking, GrantReinsertionStep<Tree>{tree, lookers, found.data(), bids.data(), granted.data()});
    engine.for_each(looking, ReinsertStep<Tree>{tree, lookers, found.data(), granted.data()});
    engine.for_each(leaves, RefitStep<Tree>{tree, met.data(), &height});
  }
}

}  // namespace hiprt::build
