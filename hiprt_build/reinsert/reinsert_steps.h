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

/// Rounds of reinsertion end when a path from the root to a leaf has more nodes. Where very many boxes overlap, moves
/// make chains: each round makes the tree deeper and gains little, and a climb to the root takes longer. A tree of 100
/// levels fits into every file: CollapsePlan::need is at most 120 after 40 levels and grows by one per level from
/// there.
inline constexpr std::uint32_t kMostReinsertionHeight = 100;

/// Rounds where the caller names none. Where splits have more than doubled the references there are fewer, so that
/// rounds times leaves does not grow further. That adds less than 0.1 % to the SAH cost (decision 0011).
/// @param references before splits. @param leaves of the tree.
HIPRT_HD inline unsigned usual_rounds(unsigned rounds, std::uint64_t references, std::uint64_t leaves) {
  return leaves <= 2 * references ? rounds : static_cast<unsigned>(2 * references * rounds / leaves);
}

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

/// Step: the best position that a limited search finds for looker i.
///
/// The search climbs to the root. At each ancestor it looks below the sibling of the node that it comes from, and there
/// first where the subtree costs less. It leaves out positions that cannot be better than the best so far.
/// @tparam Tree a LinkedTree.
template <class Tree> struct FindReinsertionStep {
  /// The most boxes that a search looks at. Few searches in ordinary scenes need as many. Where very many boxes
  /// overlap, almost every position could still be the best, and without this limit each search would visit the whole
  /// tree.
  static constexpr unsigned kMostLooks = 40;
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
    found[i] = find(subtree(tree, at));
  }

 private:
  /// A node below which the subtree may move.
  struct Candidate {
    LinkedRef ref;
    float saved;  ///< Area that the move would save if the insertion below the node cost nothing. Of a leaf: 0.
  };

  struct Search {
    FastBox box;  ///< Of the subtree that moves.
    float least;  ///< Half its area: no insertion costs less.
    Reinsertion best{0.0f, kInvalidId, kInvalidId};
    unsigned looks = 0;

    HIPRT_HD explicit Search(const FastBox& moving) : box(moving), least(moving.half_area()) {}
    HIPRT_HD bool may_look_at(unsigned boxes) const { return looks + boxes <= kMostLooks; }
    HIPRT_HD bool may_improve(float saved) const { return saved - least > best.gain; }

    /// Looks at the position beside a node. @param saved area that the move would save if it cost nothing.
    HIPRT_HD Candidate look(LinkedRef ref, const FastBox& at, std::uint32_t meet, float saved) {
      FastBox both = at;
      both.add(box);
      const float beside = saved - both.half_area();
      if (beside > best.gain) best = Reinsertion{beside, ref, meet};
      // For a position below, the node's box grows by the moving box.
      return Candidate{ref, (ref & kLinkedLeaf) != 0 ? 0.0f : beside + at.half_area()};
    }
  };

  HIPRT_HD Reinsertion find(LinkedRef moving) const {
    Search search(tree.tree.fast_box(moving));
    LinkedRef here = moving;
    std::uint32_t above = tree.parent(moving);
    // The parent is removed. Its other child replaces it.
    float saved = tree.tree.node_box(above).half_area();
    FastBox rest;
    for (;;) {
      const LinkedRef other = tree.sibling(here);
      const FastBox other_box = tree.tree.fast_box(other);
      ++search.looks;
      if (search.may_improve(saved)) search_below(search.look(other, other_box, above, saved), above, search);
      // For positions outside of its subtree, the node `above` shrinks to `rest`.
      rest.add(other_box);
      if (here != moving) saved += tree.tree.node_box(above).half_area() - rest.half_area();
      here = above;
      above = tree.parents[here];
      if (above == kInvalidId || !search.may_look_at(1)) return search.best;
    }
  }

  HIPRT_HD void search_below(Candidate here, std::uint32_t meet, Search& search) const {
    // Each entry comes from a look at two children.
    Candidate open[kMostLooks / 2];
    unsigned count = 0;
    while (search.may_look_at(2)) {
      if (search.may_improve(here.saved)) {
        const LinkedNode& node = tree.tree.nodes[here.ref];
        const LinkedRef left = node.child[0], right = node.child[1];
        search.looks += 2;
        const Candidate first = search.look(left, tree.tree.fast_box(left), meet, here.saved);
        const Candidate second = search.look(right, tree.tree.fast_box(right), meet, here.saved);
        const bool first_is_better = first.saved >= second.saved;
        const Candidate later = first_is_better ? second : first;
        if (search.may_improve(later.saved)) open[count++] = later;
        here = first_is_better ? first : second;
      } else {
        if (count == 0) return;
        here = open[--count];
      }
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
