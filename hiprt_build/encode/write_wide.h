#pragma once
/// Wide nodes and leaves of a planned linked tree, from the root down, by many threads at once. The thread that writes
/// a node leaves tasks for its child nodes. Internal.

#include <hiprt_build/collapse/wide_children.h>
#include <hiprt_build/encode/write_leaf.h>
#include <hiprt_build/format/node_places.h>
#include <hiprt_build/tree/binary_tree.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/math/atomic.h>

namespace hiprt::build {

/// Subtree sums: the plans of the wide tree.
struct PlanSums {
  CollapsePlan* plans;  ///< Of inner nodes.
  const Reference* references;
  CollapseCosts costs;

  HIPRT_HD HIPRT_FORCE_INLINE CollapsePlan plan(LinkedRef ref) const {
    if ((ref & kLinkedLeaf) == 0) return plans[ref];
    const Reference& leaf = references[ref & ~kLinkedLeaf];
    return plan_leaf(half_area(leaf.box), leaf.contents.is_pair() ? 2 : 1, leaf.contents.is_custom(), costs);
  }
  HIPRT_HD HIPRT_FORCE_INLINE void join(std::uint32_t node, LinkedRef left, LinkedRef right, const Box& box) const {
    plans[node] = plan_inner(plan(left), plan(right), half_area(box), costs);
  }
};

using PlannedTree = LinkedTree<ReferenceLeaves, PlanSums>;

/// A wide node still to be written, and where its subtree begins. The task is stored in the first bytes of the node. A
/// queue holds the numbers of such nodes, so that nodes near the root come first.
struct WideTask {
  std::uint64_t tree;    ///< Linked node, next wide node << 32: the node's subtree is there and behind.
  std::uint64_t leaves;  ///< First leaf record, stack entries on the way to the node << 32.

  HIPRT_HD static WideTask make(LinkedRef ref, std::uint32_t next, std::uint32_t first_leaf, std::uint32_t need) {
    return {std::uint64_t{next} << 32 | ref, std::uint64_t{need} << 32 | first_leaf};
  }
  HIPRT_HD LinkedRef ref() const { return static_cast<LinkedRef>(tree); }
};

/// Numbers of wide nodes in the order in which they are written. They overwrite the costs of the plans, which are not
/// read after planning.
struct WideQueue {
  CollapsePlan* plans;

  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t* entry(std::uint32_t i) const {
    return reinterpret_cast<std::uint32_t*>(&plans[i + 1].cost[0]);
  }
  HIPRT_HD HIPRT_FORCE_INLINE void clear(std::uint32_t i) const { *entry(i) = kInvalidId; }
  /// @return kInvalidId if nothing is there yet.
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t read(std::uint32_t i) const { return load_shared(entry(i)); }
  HIPRT_HD HIPRT_FORCE_INLINE void write(std::uint32_t i, std::uint32_t node) const { store_shared(entry(i), node); }
};

/// A linked tree with its plans, as WideChildren reads it.
struct PlannedNodes {
  const LinkedNode* tree;
  const CollapsePlan* plans;

  HIPRT_HD static bool is_leaf(LinkedRef ref) { return (ref & kLinkedLeaf) != 0; }
  HIPRT_HD LinkedRef child(LinkedRef ref, unsigned side) const { return tree[ref].child[side]; }
  HIPRT_HD const CollapsePlan& plan(LinkedRef ref) const { return plans[ref]; }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t leaf_count(LinkedRef ref) const {
    return is_leaf(ref) ? 1u : plans[ref].leaves;
  }
};

/// Writes wide nodes and leaves, each by itself.
template <class Layout> struct WideWriter {
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;

  /// Whether a parent states of a node what the node's own boxes are, so that all can be written at the same time.
  static constexpr bool kBoxesApart = Layout::kId == NodeLayout::kFloat || Layout::kId == NodeLayout::kPlanes;

  GeometryTable geometries;
  const LinkedNode* tree;
  const CollapsePlan* plans;
  const LeafPrimitives* primitives;  ///< Of the tree's leaves.
  NodeArray<Node> nodes;
  Leaf* leaves;
  std::uint32_t* map;                         ///< Per primitive: kInvalidId. nullptr: not wanted.
  std::uint64_t nodes_offset, leaves_offset;  ///< In the file.
  /// Of trees whose leaves hold but a part of their triangles: the leaves' boxes. Else nullptr: a primitive is in one
  /// leaf, whose box is that of its primitives.
  const Reference* parts = nullptr;
  Box* leaf_boxes = nullptr;  ///< Per leaf record; becomes what RefitFile needs. nullptr: not wanted.

  HIPRT_HD HIPRT_FORCE_INLINE bool is_run(LinkedRef ref) const {
    return (ref & kLinkedLeaf) != 0 || plans[ref].is_run();
  }
  HIPRT_HD HIPRT_FORCE_INLINE NodeRef node_ref(std::uint32_t i) const {
    return make_ref(nodes_offset + nodes.places().offset(i), Layout::kBoxType);
  }

  HIPRT_HD HIPRT_FORCE_INLINE static std::uint64_t* task_words(Node* node) {
    return reinterpret_cast<std::uint64_t*>(node);
  }
  HIPRT_HD HIPRT_FORCE_INLINE void post_task(std::uint32_t i, const WideTask& task) const {
    store_shared(task_words(&nodes[i]), task.tree);
    store_shared(task_words(&nodes[i]) + 1, task.leaves);
  }
  /// @pre the node is in the queue. All lanes of the team have it before any of them goes on to overwrite it.
  template <class Team> HIPRT_HD HIPRT_FORCE_INLINE WideTask read_task(const Team& team, std::uint32_t i) const {
    see_writes();
    const unsigned half = team.lane() & 1u;
    const std::uint64_t word = load_shared(task_words(&nodes[i]) + half);
    return {team.from(0, word), team.from(1, word)};
  }

  /// A lane's part of a wide node.
  struct Part {
    LinkedRef ref;       ///< Of the child.
    std::uint32_t node;  ///< Number of the child's wide node, or kInvalidId: it is a run.
    std::uint32_t leaf;  ///< Its first leaf record.
    std::uint32_t need;  ///< Stack entries that a traversal can have when it leaves the node.
    // Of a child that is a node:
    std::uint32_t next;   ///< Where its own child nodes begin.
    std::uint32_t below;  ///< Nodes below it.
    bool exists;
  };

  /// Finds a node's children, lane c child c.
  /// @tparam Team as many lanes as a node has children (LaneTeam): all call this together.
  template <class Team> HIPRT_HD Part open(const Team& team, const WideTask& task) const {
    static_assert(Team::kLanes == kBranching);
    const auto child = WideChildren<PlannedNodes>{planned()}.find(static_cast<LinkedRef>(task.tree), team.lane());
    const bool is_node = child.exists && !is_run(child.ref);
    const std::uint32_t below = is_node ? plans[child.ref].nodes - 1 : 0;
    std::uint32_t children = 0, child_nodes = 0, all_below = 0;
    team.before(child.exists ? 1 : 0, children);
    const std::uint32_t nodes_before = team.before(is_node ? 1 : 0, child_nodes);
    const std::uint32_t below_before = team.before(below, all_below);
    const auto next = static_cast<std::uint32_t>(task.tree >> 32);
    return {child.ref,
            is_node ? next + nodes_before : kInvalidId,
            static_cast<std::uint32_t>(task.leaves) + child.leaves_before,
            static_cast<std::uint32_t>(task.leaves >> 32) + children - 1,
            next + child_nodes + below_before,
            below,
            child.exists};
  }

  /// Writes column @p c of node i, and the leaves right below.
  HIPRT_HD void write(std::uint32_t i, unsigned c, const Part& part) const {
    NodeRef ref = kInvalidRef;
    Box box = empty_box();
    std::uint32_t flags = 0;
    if (part.exists) {
      flags = child_flags(part.ref);
      if (part.node == kInvalidId) {
        ref = write_run(part.ref, part.leaf, box);
      } else {
        box = tree[part.ref].box;
        ref = node_ref(part.node);
      }
    }
    write_column(nodes[i], c, ref, box, flags);
  }

  /// Writes the leaves of a run. @param box becomes what its parent must state. @return the reference to it.
  HIPRT_HD NodeRef write_run(LinkedRef ref, std::uint32_t first, Box& box) const {
    const std::uint32_t count = planned().leaf_count(ref);
    bool custom = false;
    box = empty_box();
    for (std::uint32_t k = 0; k < count; ++k) custom = write_leaf(first + k, find_leaf(ref, k), k + 1 == count, box);
    return make_ref(leaves_offset + std::uint64_t{first} * sizeof(Leaf),
                    custom ? NodeType::kProcedural : NodeType::kTriangle0);
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE PlannedNodes planned() const { return {tree, plans}; }

  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t child_flags(LinkedRef ref) const {
    std::uint32_t kind = 0;
    if ((ref & kLinkedLeaf) != 0)
      kind = primitives[ref & ~kLinkedLeaf].contents.is_custom() ? kHasCustoms : kHasTriangles;
    else
      kind = plans[ref].kind;
    return kChildOnlyOpaque | (kind == kHasTriangles ? kChildOnlyTriangles : 0u) |
           (kind == kHasCustoms ? kChildOnlyProcedural : 0u);
  }

  /// Child c's part of a node. Layouts that encode all boxes together get them later, from the leaves up
  /// (refit_file.h).
  HIPRT_HD static void write_column(Node& node, unsigned c, NodeRef ref, const Box& box, std::uint32_t flags) {
    node.child[c] = ref;
    if constexpr (kBoxesApart) {
      Layout::set_box(node, c, box);
      if (c < 3) node.reserved[c] = 0;
    }
    if constexpr (Layout::kHasChildFlags)
      reinterpret_cast<std::uint8_t*>(&node.child_flags)[c] = static_cast<std::uint8_t>(flags);
  }

  /// The number of the k-th leaf of a subtree.
  HIPRT_HD std::uint32_t find_leaf(LinkedRef ref, std::uint32_t k) const {
    while ((ref & kLinkedLeaf) == 0) {
      const LinkedRef left = tree[ref].child[0], right = tree[ref].child[1];
      const std::uint32_t in_left = planned().leaf_count(left);
      ref = k < in_left ? left : right;
      k -= k < in_left ? 0 : in_left;
    }
    return ref & ~kLinkedLeaf;
  }

  /// @param box grows. @return whether it is a leaf of custom primitives.
  HIPRT_HD bool write_leaf(std::uint32_t at, std::uint32_t number, bool last, Box& box) const {
    const LeafPrimitives leaf = primitives[number];
    Box whole;
    LeafWriter<Layout>{geometries, leaves}.write(at, leaf, last, whole);
    grow(box, parts != nullptr ? parts[number].box : whole);
    if (leaf_boxes != nullptr) leaf_boxes[at] = parts[number].box;
    if (map == nullptr) return leaf.contents.is_custom();
    put(map[leaf.primitive], 2 * at);
    if (leaf.contents.is_pair()) put(map[leaf.primitive + leaf.contents.distance()], 2 * at + 1);
    return leaf.contents.is_custom();
  }
  /// Keeps the first of a primitive's leaves.
  HIPRT_HD HIPRT_FORCE_INLINE void put(std::uint32_t& entry, std::uint32_t at) const {
    if (parts != nullptr)
      lower(&entry, at);
    else
      entry = at;
  }
};

}  // namespace hiprt::build
