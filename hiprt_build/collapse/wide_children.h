#pragma once
/// The children of a wide node, from the plans of its binary tree. Internal.

#include <hiprt_build/collapse/collapse_plan.h>

#include <cstdint>

namespace hiprt::build {

/// @tparam Tree has is_leaf(ref), child(ref, side), plan(ref) and leaf_count(ref).
template <class Tree> struct WideChildren {
  struct Child {
    std::uint32_t ref;
    std::uint32_t leaves_before;  ///< Of the children before it.
    bool exists;
  };

  Tree tree;

  /// Child @p c, 0 to 3, of the wide node of a binary node.
  HIPRT_HD Child find(std::uint32_t ref, unsigned c) const {
    WideSplit share = wide_split(tree.plan(ref));
    Child child{ref, 0, true};
    for (;;) {
      const std::uint32_t left = tree.child(child.ref, 0), right = tree.child(child.ref, 1);
      const unsigned in_left = count(left, share.left);
      const bool go_left = c < in_left;
      child.leaves_before += go_left ? 0 : tree.leaf_count(left);
      child.ref = go_left ? left : right;
      c -= go_left ? 0 : in_left;
      const unsigned slots = go_left ? share.left : share.right, split = split_of(child.ref, slots);
      if (split == 0) break;
      // Where the third slot is unused the plan is that of two.
      const bool three = slots == 3 && tree.plan(child.ref).choice2 != 0;
      share = {split, (three ? 3u : 2u) - split};
    }
    child.exists = c == 0;
    return child;
  }

 private:
  /// How many children of a subtree that is shown as at most @p slots come from its left child; 0: it is one child.
  HIPRT_HD unsigned split_of(std::uint32_t ref, unsigned slots) const {
    if (slots < 2 || tree.is_leaf(ref)) return 0;
    const CollapsePlan& plan = tree.plan(ref);
    return slots == 3 && plan.choice2 != 0 ? plan.choice2 : plan.choice1;
  }
  /// Children of a subtree that is shown as at most @p slots, 1 to 3.
  HIPRT_HD unsigned count(std::uint32_t ref, unsigned slots) const {
    const unsigned from_left = split_of(ref, slots);
    if (from_left == 0) return 1;
    if (slots == 2 || tree.plan(ref).choice2 == 0) return 2;
    // One side is one child; the other has two slots.
    const std::uint32_t two = tree.child(ref, from_left == 1 ? 1 : 0);
    return split_of(two, 2) != 0 ? 3 : 2;
  }
};

}  // namespace hiprt::build
