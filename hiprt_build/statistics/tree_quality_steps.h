#pragma once
/// How good a file's tree is, node by node. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/encode/wide_node.h>
#include <hiprt_build/format/node_places.h>
#include <hiprt_device/format/buffer.h>

namespace hiprt::build {

/// Half the surface; in double, because float areas of large scenes overflow.
HIPRT_HD constexpr double exact_half_area(const Box& box) {
  const double x = static_cast<double>(box.max[0]) - static_cast<double>(box.min[0]);
  const double y = static_cast<double>(box.max[1]) - static_cast<double>(box.min[1]);
  const double z = static_cast<double>(box.max[2]) - static_cast<double>(box.min[2]);
  return x * y + y * z + z * x;
}

/// Sums over the children of nodes. Areas are half the surface of the boxes that their parents state.
struct QualitySums {
  double costs = 0;
  double area_costs = 0;  ///< Areas times costs.
  double inner = 0;       ///< Areas of box nodes.
  double savings = 0;     ///< What the best exchange for each box node would take from its area.

  HIPRT_HD constexpr void add(const QualitySums& other) {
    costs += other.costs;
    area_costs += other.area_costs;
    inner += other.inner;
    savings += other.savings;
  }
  /// TreeStatistics::exchange_slack.
  HIPRT_HD constexpr double exchange_slack() const { return inner > 0 ? savings / inner : 0; }
};

/// The tree of a file.
template <class Layout> struct TreeQuality {
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;

  const FileHeader* header;
  NodeArray<const Node> nodes;
  const Leaf* leaves;
  std::uint64_t first_node, first_leaf;  ///< Byte offsets in the file.
  SahCosts costs;

  /// What a node states for a child.
  HIPRT_HD HIPRT_FORCE_INLINE Box stated_box(const Node& node, unsigned child) const {
    return build::stated_box<Layout>(node, child, header->bounds);
  }
  HIPRT_HD HIPRT_FORCE_INLINE const Node& node(NodeRef ref) const {
    return nodes[nodes.places().number(ref_offset(ref) - first_node)];
  }
  /// The first leaf of a run.
  HIPRT_HD HIPRT_FORCE_INLINE const Leaf* run(NodeRef ref) const {
    return leaves + (ref_offset(ref) - first_leaf) / sizeof(Leaf);
  }

  /// Of a node without what is below it, or of all leaves of a run.
  HIPRT_HD HIPRT_FORCE_INLINE double own_cost(NodeRef ref) const {
    if (is_box(ref)) return static_cast<double>(costs.box_node);
    unsigned count = 1;
    for (const Leaf* at = run(ref); (at->info.geometry_and_flags & kLastInRun) == 0; ++at) ++count;
    return count * static_cast<double>(ref_type(ref) == NodeType::kProcedural ? costs.custom : costs.leaf);
  }

  /// TreeStatistics::sah_cost. A scene in one point or on one line: every ray that meets the root meets everything.
  HIPRT_HD HIPRT_FORCE_INLINE double sah_cost(const QualitySums& all) const {
    if (header->root == kInvalidRef) return 0;
    const double area = exact_half_area(header->bounds);
    return own_cost(header->root) + (area > 0 ? all.area_costs / area : all.costs);
  }

  /// Of node i's children.
  HIPRT_HD HIPRT_FORCE_INLINE QualitySums operator()(std::size_t i) const {
    const Node& parent = nodes[i];
    Box boxes[kBranching];
    for (unsigned c = 0; c < kBranching; ++c) boxes[c] = stated_box(parent, c);
    QualitySums sums;
    for (unsigned c = 0; c < kBranching; ++c) {
      if (parent.child[c] == kInvalidRef) continue;
      const double area = exact_half_area(boxes[c]), cost = own_cost(parent.child[c]);
      sums.costs += cost;
      sums.area_costs += cost * area;
      if (!is_box(parent.child[c])) continue;
      sums.inner += area;
      sums.savings += area - least_area(parent, boxes, c, area);
    }
    return sums;
  }

 private:
  /// Of child c, a node, after exchanging one of its children for another child of the parent, or nothing.
  /// @param area before.
  HIPRT_HD HIPRT_FORCE_INLINE double least_area(const Node& parent, const Box (&boxes)[kBranching], unsigned c,
                                                double area) const {
    const Node& child = node(parent.child[c]);
    Box below[kBranching];
    for (unsigned g = 0; g < kBranching; ++g) below[g] = stated_box(child, g);
    double least = area;
    for (unsigned out = 0; out < kBranching; ++out) {
      if (child.child[out] == kInvalidRef) continue;
      Box rest = empty_box();
      for (unsigned g = 0; g < kBranching; ++g)
        if (g != out) grow(rest, below[g]);
      for (unsigned in = 0; in < kBranching; ++in) {
        if (in == c || parent.child[in] == kInvalidRef) continue;
        const double exchanged = exact_half_area(unite(rest, boxes[in]));
        least = exchanged < least ? exchanged : least;
      }
    }
    return least;
  }
};

}  // namespace hiprt::build
