#pragma once
/// Wide nodes and leaves of a planned linked tree, from the root down, by many threads at once: whoever writes a node
/// leaves a task in the places of its child nodes. Internal.

#include <hiprt_build/steps/collapse_plan.h>
#include <hiprt_build/steps/linked_tree.h>
#include <hiprt_build/steps/soup_view.h>
#include <hiprt_device/atomic.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/layout.h>

namespace hiprt::build {

/// The primitives of a leaf of the linked tree.
struct LeafPrimitives {
  std::uint32_t primitive;  ///< The lower one, in the numbering of all.
  PackedGroup group;
};

/// What a tree sums up for its wide form.
struct PlanSums {
  CollapsePlan* plans;  ///< Of inner nodes.
  const LeafReference* references;
  CollapseCosts costs;

  HIPRT_HD HIPRT_INLINE CollapsePlan plan(LinkedRef ref) const {
    if ((ref & kLinkedLeaf) == 0) return plans[ref];
    const LeafReference& leaf = references[ref & ~kLinkedLeaf];
    return plan_leaf(half_area(leaf.box), leaf.group.is_pair() ? 2 : 1, leaf.group.is_custom(), costs);
  }
  HIPRT_HD HIPRT_INLINE void join(std::uint32_t node, LinkedRef left, LinkedRef right, const Box& box) const {
    plans[node] = plan_inner(plan(left), plan(right), half_area(box), costs);
  }
};

/// A wide node that is to be written: where its subtree's parts begin. In the first bytes of its place until then.
struct WideTask {
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};

  std::uint64_t tree = kNone;    ///< Linked node, next wide node << 32: the node's subtree is there and behind.
  std::uint64_t leaves = kNone;  ///< First leaf record, stack entries on the way to the node << 32.
};

/// Children of a wide node.
struct WideChildren {
  LinkedRef ref[kBranching];
  unsigned count = 0;

  HIPRT_HD void add(LinkedRef child) { ref[count++] = child; }
};

/// What is written where.
template <class Layout> struct WideWriter {
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;

  SoupView soup;
  const LinkedNode* tree;
  const CollapsePlan* plans;
  const LeafPrimitives* primitives;  ///< Of the tree's leaves.
  Node* nodes;
  Leaf* leaves;
  std::uint32_t* map;                         ///< Per primitive: kInvalidId.
  std::uint64_t nodes_offset, leaves_offset;  ///< In the file.

  HIPRT_HD HIPRT_INLINE std::uint32_t leaf_count(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 ? 1u : plans[ref].leaves;
  }
  HIPRT_HD HIPRT_INLINE bool is_run(LinkedRef ref) const { return (ref & kLinkedLeaf) != 0 || plans[ref].is_run(); }
  HIPRT_HD HIPRT_INLINE NodeRef node_ref(std::uint32_t i) const {
    return make_ref(nodes_offset + std::uint64_t{i} * sizeof(Node), Layout::kBoxType);
  }

  HIPRT_HD HIPRT_INLINE static std::uint64_t* task_words(Node* node) { return reinterpret_cast<std::uint64_t*>(node); }
  HIPRT_HD void clear_task(std::uint32_t i) const {
    task_words(nodes + i)[0] = WideTask::kNone;
    task_words(nodes + i)[1] = WideTask::kNone;
  }
  HIPRT_HD HIPRT_INLINE void post_task(std::uint32_t i, LinkedRef ref, std::uint32_t next, std::uint32_t first,
                                       std::uint32_t need) const {
    store_shared(task_words(nodes + i), std::uint64_t{next} << 32 | ref);
    store_shared(task_words(nodes + i) + 1, std::uint64_t{need} << 32 | first);
  }
  /// @return whether the task is there.
  HIPRT_HD HIPRT_INLINE bool take_task(std::uint32_t i, WideTask& task) const {
    task.tree = load_shared(task_words(nodes + i));
    task.leaves = load_shared(task_words(nodes + i) + 1);
    return task.tree != WideTask::kNone && task.leaves != WideTask::kNone;
  }

  /// Writes node i and the leaves right below it, and posts tasks for its child nodes.
  /// @return stack entries that a traversal can have when it leaves the node.
  HIPRT_HD std::uint32_t write(std::uint32_t i, const WideTask& task) const {
    const WideChildren children = find_children(static_cast<LinkedRef>(task.tree));
    auto leaf = static_cast<std::uint32_t>(task.leaves);
    const std::uint32_t need = static_cast<std::uint32_t>(task.leaves >> 32) + children.count - 1;
    std::uint32_t slot = static_cast<std::uint32_t>(task.tree >> 32), next = slot;
    for (unsigned c = 0; c < children.count; ++c) next += is_run(children.ref[c]) ? 0 : 1;
    Node node{};
    Box boxes[kBranching];
    std::uint32_t flags = 0;
    for (unsigned c = 0; c < kBranching; ++c) {
      node.child[c] = kInvalidRef;
      boxes[c] = empty_box();
      if (c >= children.count) continue;
      const LinkedRef ref = children.ref[c];
      if (is_run(ref)) {
        node.child[c] = write_run(ref, leaf, boxes[c]);
      } else {
        boxes[c] = tree[ref].box;
        node.child[c] = node_ref(slot);
        post_task(slot++, ref, next, leaf, need);
        next += plans[ref].nodes - 1;
      }
      leaf += leaf_count(ref);
      flags |= child_flags(ref) << (8 * c);
    }
    Layout::set_child_flags(node, flags);
    Layout::set_boxes(node, boxes);
    nodes[i] = node;
    return need;
  }

  /// Writes the leaves of a run. @param box becomes what its parent must state. @return the reference to it.
  HIPRT_HD NodeRef write_run(LinkedRef ref, std::uint32_t first, Box& box) const {
    const std::uint32_t count = leaf_count(ref);
    bool custom = false;
    box = empty_box();
    for (std::uint32_t k = 0; k < count; ++k)
      custom = write_leaf(first + k, primitives[find_leaf(ref, k)], k + 1 == count, box);
    return make_ref(leaves_offset + std::uint64_t{first} * sizeof(Leaf),
                    custom ? NodeType::kProcedural : NodeType::kTriangle0);
  }

 private:
  HIPRT_HD HIPRT_INLINE std::uint32_t child_flags(LinkedRef ref) const {
    std::uint32_t kind = 0;
    if ((ref & kLinkedLeaf) != 0)
      kind = primitives[ref & ~kLinkedLeaf].group.is_custom() ? kHasCustoms : kHasTriangles;
    else
      kind = plans[ref].kind;
    return kChildOnlyOpaque | (kind == kHasTriangles ? kChildOnlyTriangles : 0u) |
           (kind == kHasCustoms ? kChildOnlyProcedural : 0u);
  }

  HIPRT_HD WideChildren find_children(LinkedRef ref) const {
    WideChildren children;
    const WideShare share = wide_share(plans[ref]);
    const LinkedRef left = tree[ref].child[0], right = tree[ref].child[1];
    add_three(left, share.left, children);
    add_three(right, share.right, children);
    return children;
  }
  /// The subtree as at most @p slots children, 1 to 3.
  HIPRT_HD void add_three(LinkedRef ref, unsigned slots, WideChildren& children) const {
    const unsigned from_left = slots == 3 && (ref & kLinkedLeaf) == 0 ? plans[ref].choice2 : 0u;
    if (from_left == 0) return add_two(ref, slots, children);
    const LinkedRef left = tree[ref].child[0], right = tree[ref].child[1];
    add_two(left, from_left, children);
    add_two(right, 3 - from_left, children);
  }
  HIPRT_HD void add_two(LinkedRef ref, unsigned slots, WideChildren& children) const {
    if (slots < 2 || (ref & kLinkedLeaf) != 0 || plans[ref].choice1 == 0) return children.add(ref);
    const LinkedRef left = tree[ref].child[0], right = tree[ref].child[1];
    children.add(left);
    children.add(right);
  }

  /// The number of the k-th leaf of a subtree.
  HIPRT_HD std::uint32_t find_leaf(LinkedRef ref, std::uint32_t k) const {
    while ((ref & kLinkedLeaf) == 0) {
      const LinkedRef left = tree[ref].child[0], right = tree[ref].child[1];
      const std::uint32_t in_left = leaf_count(left);
      ref = k < in_left ? left : right;
      k -= k < in_left ? 0 : in_left;
    }
    return ref & ~kLinkedLeaf;
  }

  /// @return whether it is a leaf of custom primitives.
  HIPRT_HD bool write_leaf(std::uint32_t place, const LeafPrimitives& leaf, bool last, Box& box) const {
    const std::uint32_t g = soup.find(leaf.primitive);
    const GeometryView& geometry = soup.geometries[g];
    const std::uint32_t first = leaf.primitive - geometry.first;
    const PackedGroup group = leaf.group;
    const LeafInfo info{{first, group.is_pair() ? first + group.distance() : kInvalidId},
                        g | (last ? kLastInRun : 0u),
                        group.is_custom()
                            ? TriangleId::kCustom * (group.is_pair() ? 0x101u : 1u)
                            : TriangleId::from_rotation(group.rotation0()) |
                                  (group.is_pair() ? TriangleId::from_rotation(group.rotation1()) << 8 : 0u)};
    if (group.is_custom())
      write_custom(place, geometry, info, box);
    else
      write_triangles(place, leaf_corners(geometry, first, group), info, box);
    map[leaf.primitive] = 2 * place;
    if (group.is_pair()) map[leaf.primitive + group.distance()] = 2 * place + 1;
    return group.is_custom();
  }
  HIPRT_HD void write_triangles(std::uint32_t place, const LeafCorners& corners, const LeafInfo& info, Box& box) const {
    Leaf record{};
    for (unsigned v = 0; v < 4; ++v) {
      grow(box, corners.v[v]);
      for (unsigned axis = 0; axis < 3; ++axis) Layout::set_coordinate(record, v, axis, corners.v[v].x[axis]);
    }
    record.info = info;
    leaves[place] = record;
  }
  HIPRT_HD void write_custom(std::uint32_t place, const GeometryView& customs, const LeafInfo& info, Box& box) const {
    const Box first = customs.boxes[info.primitive[0]];
    const Box second = info.primitive[1] == kInvalidId ? empty_box() : customs.boxes[info.primitive[1]];
    static_assert(sizeof(Leaf) == sizeof(CustomLeaf));
    *reinterpret_cast<CustomLeaf*>(leaves + place) = CustomLeaf{{first, second}, info};
    grow(box, first);
    if (info.primitive[1] != kInvalidId) grow(box, second);
  }
};

}  // namespace hiprt::build
