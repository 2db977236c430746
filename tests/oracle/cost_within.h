#pragma once
/// The surface area heuristic (SAH) for a part of a scene.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/layout.h>
#include <tests/oracle/nodes_of.h>

#include <algorithm>

namespace hiprt::oracle {

namespace cost_detail {

inline double half_area(const Box& box) {
  double edge[3];
  for (unsigned axis = 0; axis < 3; ++axis) edge[axis] = std::max(0.0, double{box.max[axis]} - double{box.min[axis]});
  return edge[0] * edge[1] + edge[1] * edge[2] + edge[2] * edge[0];
}

inline double common_half_area(const Box& a, const Box& b) {
  Box common{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    common.min[axis] = std::max(a.min[axis], b.min[axis]);
    common.max[axis] = std::min(a.max[axis], b.max[axis]);
    if (common.min[axis] > common.max[axis]) return 0;
  }
  return half_area(common);
}

template <class Layout> double cost_within(const BufferView& view, const Box& part, const build::SahCosts& costs) {
  // The root is hit by every ray.
  double cost = costs.box_node * half_area(part);
  for (const auto& node : nodes_of<typename Layout::Node>(view))
    for (unsigned child = 0; child < kBranching; ++child)
      if (node.child[child] != kInvalidRef)
        cost += (is_box(node.child[child]) ? costs.box_node : costs.leaf) *
                common_half_area(Layout::box(node, child), part);
  return cost / half_area(part);
}

}  // namespace cost_detail

/// The expected cost of a ray through @p part, a box inside the scene. Such a ray meets a node with a probability of
/// area(node's box within part) / area(part). (build::measure_tree() measures rays through the whole scene, where small
/// objects hardly count.)
/// @pre layout kFloat or kPlanes, and the root is a box node. A run of leaves counts as one leaf.
inline double cost_within(const BufferView& view, const Box& part, const build::SahCosts& costs = {}) {
  return dispatch_layout(view.layout(),
                         [&](auto layout) { return cost_detail::cost_within<decltype(layout)>(view, part, costs); });
}

}  // namespace hiprt::oracle
