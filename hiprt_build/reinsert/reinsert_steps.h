#pragma once
/// Reinsertion of subtrees (Meister and Bittner, "Parallel reinsertion for bounding volume hierarchy optimization",
/// 2018). Internal.
///
/// In a round every subtree searches for the position that reduces the area of the inner nodes most. Its bid is this
/// reduction. A subtree moves if two conditions hold. It is the highest bidder for every node whose links the move
/// changes. And no other subtree moves on the path from the lowest common node down to the new position. So no two
/// subtrees can end up below each other. (A cycle of moves would contain such a path: otherwise each of its subtrees
/// would be above the next.)

#include <hiprt_build/refit/refit_steps.h>

#include <bit>

namespace hiprt::build {

/// The best new position of a subtree. gain 0: it stays.
struct Reinsertion {
  float gain;          ///< Area that inner nodes lose.
  LinkedRef beside;    ///< Its new sibling.
  std::uint32_t meet;  ///< The lowest common node above the old and the new position.
};

/// Subtrees have the numbers of ParentedTree::parents: inner node k is k, leaf k is leaves + k.
template <class Tree> HIPRT_HD LinkedRef subtree(const ParentedTree<Tree>& tree, std::uint32_t number) {
  return number < tree.leaves ? number : (number - tree.leaves) | kLinkedLeaf;
}

/// The subtrees that search in a round: every 2^shift-th. Arrays over them are indexed by looker().
struct Lookers {
  /// If all subtrees searched at once, most moves would conflict.
  static constexpr unsigned kUsualShift = 3;

  unsigned shift;
  std::uint32_t phase;  ///< Below 2^shift.

  HIPRT_HD static std::uint32_t count(std::uint32_t subtrees, unsigned shift) {
    return (subtrees + (1u << shift) - 1) >> shift;
  }
  HIPRT_HD std::uint32_t subtree(std::uint32_t looker) const { return looker << shift | phase; }
  HIPRT_HD bool includes(std::uint32_t subtree) const { return (subtree & ((1u << shift) - 1)) == phase; }
  HIPRT_HD std::uint32_t looker(std::uint32_t subtree) const { return subtree >> shift; }
};

/// Step: the best position for looker i.
/// @tparam Tree a LinkedTree.
template <class Tree> struct FindReinsertionStep {
  /// The most subtrees that a search keeps for later; it skips further ones.
  static constexpr unsigned kOpen = 96;
  /// For the CPU's engine.
  static constexpr std::size_t kChunk = 64;

  ParentedTree<Tree> tree;
  Lookers lookers;
  Reinsertion* found;

  HIPRT_HD void operator()(std::size_t i) const {
    const std::uint32_t at = lookers.subtree(static_cast<std::uint32_t>(i));
    found[i] = Reinsertion{0.0f, kInvalidId, kInvalidId};
    // There is no inner node 0. The root and its children cannot move.
    if (at == 0 || at >= 2 * tree.leaves || tree.parents[at] == kInvalidId ||
        tree.parents[tree.parents[at]] == kInvalidId)
      return;
    found[i] = search(subtree(tree, at));
  }

 private:
  HIPRT_HD Reinsertion search(LinkedRef moving) const {
    const Box box = tree.tree.box(moving);
    const float least = half_area(box);
    Reinsertion best{0.0f, kInvalidId, kInvalidId};
    std::uint32_t above = tree.parent(moving);
    // The parent is removed. Its other child replaces it.
    float saved = half_area(tree.tree.nodes[above].box);
    LinkedRef other = tree.sibling(moving);
    Box rest = tree.tree.box(other);
    search_below(other, above, box, least, saved, best);
    // For positions outside of its subtree, the node `above` shrinks to `rest`.
    for (;;) {
      const LinkedRef here = above;
      above = tree.parents[here];
      if (above == kInvalidId) return best;
      other = tree.sibling(here);
      search_below(other, above, box, least, saved, best);
      grow(rest, tree.tree.box(other));
      saved += half_area(tree.tree.nodes[above].box) - half_area(rest);
    }
  }

  /// @param saved area that the move would save if the insertion below @p root cost nothing.
  HIPRT_HD void search_below(LinkedRef root, std::uint32_t meet, const Box& box, float least, float saved,
                             Reinsertion& best) const {
    struct Open {
      LinkedRef ref;
      float saved;
    } open[kOpen];
    unsigned count = 0;
    open[count++] = {root, saved};
    while (count > 0) {
      const Open here = open[--count];
      if (!(here.saved - least > best.gain)) continue;
      const Box before = tree.tree.box(here.ref);
      const float beside = here.saved - half_area(unite(before, box));
      if (beside > best.gain) best = Reinsertion{beside, here.ref, meet};
      if ((here.ref & kLinkedLeaf) != 0 || count + 2 > kOpen) continue;
      // For a position below, the node's box grows by the moving box.
      const float below = beside + half_area(before);
      if (!(below - least > best.gain)) continue;
      const LinkedNode& node = tree.tree.nodes[here.ref];
      open[count++] = {node.child[1], below};
      open[count++] = {node.child[0], below};
    }
  }
};

/// Bids for one subtree, numbered as subtrees are.
struct ReinsertionBids {
  std::uint64_t change;  ///< The highest bid of a subtree whose move changes the links of this one.
  std::uint64_t pass;    ///< The highest bid of a subtree whose path down passes this one.
};

/// A bid: the gain's bits, which have the same order as the gains, then the subtree's number. 0: the subtree stays.
HIPRT_HD HIPRT_FORCE_INLINE std::uint64_t reinsertion_bid(const Reinsertion& move, std::uint32_t number) {
  return move.gain > 0.0f ? std::uint64_t{std::bit_cast<std::uint32_t>(move.gain)} << 32 | number : 0;
}

/// The subtrees that a move affects.
template <class Tree> struct ReinsertionPath {
  ParentedTree<Tree> tree;
  LinkedRef moving;
  Reinsertion move;

  HIPRT_HD std::uint32_t number(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 ? tree.leaves + (ref & ~kLinkedLeaf) : ref;
  }
  /// Calls visit(number) for every subtree whose links change.
  template <class Visit> HIPRT_HD HIPRT_FORCE_INLINE void visit_changed(Visit&& visit) const {
    const std::uint32_t parent = tree.parent(moving);
    visit(number(moving));
    visit(parent);
    visit(number(tree.sibling(moving)));
    visit(tree.parents[parent]);
    visit(tree.parent(move.beside));
    visit(number(move.beside));
  }
  /// Calls visit(number) for every subtree on the path from the lowest common node down to the new position.
  template <class Visit> HIPRT_HD HIPRT_FORCE_INLINE void visit_passed(Visit&& visit) const {
    for (LinkedRef ref = move.beside; ref != move.meet; ref = tree.parent(ref)) visit(number(ref));
  }
};

/// Step: looker i bids. `bids` is all 0 before.
template <class Tree> struct BidReinsertionStep {
  ParentedTree<Tree> tree;
  Lookers lookers;
  const Reinsertion* found;
  ReinsertionBids* bids;

  HIPRT_HD void operator()(std::size_t i) const {
    const std::uint32_t at = lookers.subtree(static_cast<std::uint32_t>(i));
    const std::uint64_t bid = reinsertion_bid(found[i], at);
    if (bid == 0) return;
    const ReinsertionPath<Tree> path{tree, subtree(tree, at), found[i]};
    path.visit_changed([&](std::uint32_t number) { raise(&bids[number].change, bid); });
    path.visit_passed([&](std::uint32_t number) { raise(&bids[number].pass, bid); });
  }
};

/// Step: whether looker i may move.
template <class Tree> struct GrantReinsertionStep {
  ParentedTree<Tree> tree;
  Lookers lookers;
  const Reinsertion* found;
  const ReinsertionBids* bids;
  std::uint8_t* granted;

  HIPRT_HD void operator()(std::size_t i) const {
    const std::uint32_t at = lookers.subtree(static_cast<std::uint32_t>(i));
    const std::uint64_t bid = reinsertion_bid(found[i], at);
    bool mine = bid != 0 && bids[at].pass <= bid;
    if (mine) {
      const ReinsertionPath<Tree> path{tree, subtree(tree, at), found[i]};
      path.visit_changed([&](std::uint32_t number) { mine = mine && bids[number].change == bid; });
      path.visit_passed([&](std::uint32_t number) { mine = mine && bid_of(number) < bid; });
    }
    granted[i] = mine ? 1 : 0;
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE std::uint64_t bid_of(std::uint32_t number) const {
    return lookers.includes(number) ? reinsertion_bid(found[lookers.looker(number)], number) : 0;
  }
};

/// Step: moves looker i together with its parent node. Boxes and counts must be refitted afterwards.
template <class Tree> struct ReinsertStep {
  ParentedTree<Tree> tree;
  Lookers lookers;
  const Reinsertion* found;
  const std::uint8_t* granted;

  HIPRT_HD void operator()(std::size_t i) const {
    if (granted[i] == 0) return;
    const LinkedRef moving = subtree(tree, lookers.subtree(static_cast<std::uint32_t>(i)));
    const LinkedRef beside = found[i].beside;
    const std::uint32_t parent = tree.parent(moving);
    const LinkedRef left_behind = tree.sibling(moving);
    tree.replace_child(tree.parents[parent], parent, left_behind);
    tree.replace_child(tree.parent(beside), beside, parent);
    tree.replace_child(parent, left_behind, beside);
  }
};

}  // namespace hiprt::build
