#pragma once
/// The node records of each layout behind one vocabulary, so that builder, validator and traversal are written once.
/// Every layout's `Node` and `Leaf` decode to the same values, bit for bit.

#include <hiprt_device/format/node.h>

namespace hiprt {

struct FloatLayout {
  static constexpr NodeLayout kId = NodeLayout::kFloat;
  using Node = FloatBoxNode;
  using Leaf = FloatLeaf;

  HIPRT_HD static HIPRT_INLINE Box box(const Node& node, unsigned child) { return node.box[child]; }
  HIPRT_HD static HIPRT_INLINE void set_box(Node& node, unsigned child, const Box& box) { node.box[child] = box; }
  HIPRT_HD static HIPRT_INLINE float coordinate(const Leaf& leaf, unsigned vertex, unsigned axis) {
    return leaf.vertex[vertex][axis];
  }
  HIPRT_HD static HIPRT_INLINE void set_coordinate(Leaf& leaf, unsigned vertex, unsigned axis, float value) {
    leaf.vertex[vertex][axis] = value;
  }
};

struct PlanesLayout {
  static constexpr NodeLayout kId = NodeLayout::kPlanes;
  using Node = PlanesBoxNode;
  using Leaf = PlanesLeaf;

  HIPRT_HD static HIPRT_INLINE Box box(const Node& node, unsigned child) {
    return Box{{node.plane[0][0][child], node.plane[1][0][child], node.plane[2][0][child]},
               {node.plane[0][1][child], node.plane[1][1][child], node.plane[2][1][child]}};
  }
  HIPRT_HD static HIPRT_INLINE void set_box(Node& node, unsigned child, const Box& box) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      node.plane[axis][0][child] = box.min[axis];
      node.plane[axis][1][child] = box.max[axis];
    }
  }
  HIPRT_HD static HIPRT_INLINE float coordinate(const Leaf& leaf, unsigned vertex, unsigned axis) {
    return leaf.coordinate[axis][vertex];
  }
  HIPRT_HD static HIPRT_INLINE void set_coordinate(Leaf& leaf, unsigned vertex, unsigned axis, float value) {
    leaf.coordinate[axis][vertex] = value;
  }
};

/// Vertex number (0-3) of corner 0, 1, 2 of triangle 0 or 1 of a leaf: (v0, v1, v2) and (v1, v3, v2).
HIPRT_HD constexpr unsigned corner_vertex(unsigned triangle, unsigned corner) {
  return triangle == 0 ? corner : corner == 0 ? 1u : corner == 1 ? 3u : 2u;
}

/// Calls function(LayoutType{}) for the layout of a file. @pre open_buffer() accepted the file.
template <class Function> decltype(auto) dispatch_layout(NodeLayout layout, Function&& function) {
  return layout == NodeLayout::kFloat ? function(FloatLayout{}) : function(PlanesLayout{});
}

}  // namespace hiprt
