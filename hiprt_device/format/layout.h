#pragma once
/// The node records of each layout behind one interface, so that builder, validator and traversal are written once.
///
/// A layout is a struct with these members:
///
///     kId, kBoxType                        as in the file header, and in the references to its nodes
///     Node, Leaf                           the records; Leaf is that of triangles (custom leaves: custom_leaf())
///     box(node, child)                     the box that the node's planes encode; the empty box for an absent child
///     set_boxes(node, boxes)               encodes all four boxes, rounding outwards; an empty box is an absent child.
///                                          false: the layout cannot encode them. References and flags stay the same
///     child_flags, set_child_flags         do nothing in a layout without child flags (kHasChildFlags)
///     coordinate, set_coordinate           of a triangle leaf

#include <hiprt_device/format/half.h>
#include <hiprt_device/format/node.h>
#include <hiprt_device/format/quantize.h>

namespace hiprt {

namespace layout_detail {

/// The triangle leaf of layouts float and half.
struct FloatLeaves {
  using Leaf = FloatLeaf;

  HIPRT_HD static HIPRT_FORCE_INLINE float coordinate(const Leaf& leaf, unsigned vertex, unsigned axis) {
    return leaf.vertex[vertex][axis];
  }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_coordinate(Leaf& leaf, unsigned vertex, unsigned axis, float value) {
    leaf.vertex[vertex][axis] = value;
  }
};

/// The triangle leaf of layouts planes and quantized.
struct PlanesLeaves {
  using Leaf = PlanesLeaf;

  HIPRT_HD static HIPRT_FORCE_INLINE float coordinate(const Leaf& leaf, unsigned vertex, unsigned axis) {
    return leaf.coordinate[axis][vertex];
  }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_coordinate(Leaf& leaf, unsigned vertex, unsigned axis, float value) {
    leaf.coordinate[axis][vertex] = value;
  }
};

template <class NodeRecord> struct StoredChildFlags {
  static constexpr bool kHasChildFlags = true;

  HIPRT_HD static HIPRT_FORCE_INLINE std::uint32_t child_flags(const NodeRecord& node) { return node.child_flags; }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_child_flags(NodeRecord& node, std::uint32_t flags) {
    node.child_flags = flags;
  }
};

}  // namespace layout_detail

/// Boxes of floats, one after the other, in the form that the ray instructions of AMD read.
struct FloatLayout : layout_detail::FloatLeaves, layout_detail::StoredChildFlags<FloatBoxNode> {
  static constexpr NodeLayout kId = NodeLayout::kFloat;
  static constexpr NodeType kBoxType = NodeType::kBox32;
  using Node = FloatBoxNode;

  HIPRT_HD static HIPRT_FORCE_INLINE Box box(const Node& node, unsigned child) { return node.box[child]; }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_box(Node& node, unsigned child, const Box& box) { node.box[child] = box; }
  HIPRT_HD static HIPRT_FORCE_INLINE bool set_boxes(Node& node, const Box (&boxes)[kBranching]) {
    for (unsigned child = 0; child < kBranching; ++child) set_box(node, child, boxes[child]);
    return true;
  }
};

/// The same boxes by planes, four children side by side. The default.
struct PlanesLayout : layout_detail::PlanesLeaves, layout_detail::StoredChildFlags<PlanesBoxNode> {
  static constexpr NodeLayout kId = NodeLayout::kPlanes;
  static constexpr NodeType kBoxType = NodeType::kBox32;
  using Node = PlanesBoxNode;

  HIPRT_HD static HIPRT_FORCE_INLINE Box box(const Node& node, unsigned child) {
    return Box{{node.plane[0][0][child], node.plane[1][0][child], node.plane[2][0][child]},
               {node.plane[0][1][child], node.plane[1][1][child], node.plane[2][1][child]}};
  }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_box(Node& node, unsigned child, const Box& box) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      node.plane[axis][0][child] = box.min[axis];
      node.plane[axis][1][child] = box.max[axis];
    }
  }
  HIPRT_HD static HIPRT_FORCE_INLINE bool set_boxes(Node& node, const Box (&boxes)[kBranching]) {
    for (unsigned child = 0; child < kBranching; ++child) set_box(node, child, boxes[child]);
    return true;
  }
};

/// Boxes of half floats. Coordinates beyond +-65504 become infinite planes.
struct HalfLayout : layout_detail::FloatLeaves {
  static constexpr NodeLayout kId = NodeLayout::kHalf;
  static constexpr NodeType kBoxType = NodeType::kBox16;
  static constexpr bool kHasChildFlags = false;
  using Node = HalfBoxNode;

  HIPRT_HD static HIPRT_FORCE_INLINE Box box(const Node& node, unsigned child) {
    const Node::HalfBox& half = node.box[child];
    return Box{{half_to_float(half.min[0]), half_to_float(half.min[1]), half_to_float(half.min[2])},
               {half_to_float(half.max[0]), half_to_float(half.max[1]), half_to_float(half.max[2])}};
  }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_box(Node& node, unsigned child, const Box& box) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      node.box[child].min[axis] = half_below(box.min[axis]);
      node.box[child].max[axis] = half_above(box.max[axis]);
    }
  }
  HIPRT_HD static HIPRT_FORCE_INLINE bool set_boxes(Node& node, const Box (&boxes)[kBranching]) {
    for (unsigned child = 0; child < kBranching; ++child) set_box(node, child, boxes[child]);
    return true;
  }
  HIPRT_HD static HIPRT_FORCE_INLINE std::uint32_t child_flags(const Node&) { return 0; }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_child_flags(Node&, std::uint32_t) {}
};

/// Replaces infinite planes, which layout half may have, by the planes of the file's bounds.
HIPRT_HD HIPRT_FORCE_INLINE Box bounded(Box box, const Box& bounds) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (box.min[axis] == -kInfinity) box.min[axis] = bounds.min[axis];
    if (box.max[axis] == kInfinity) box.max[axis] = bounds.max[axis];
  }
  return box;
}

/// Boxes of bytes on a grid. Boxes beyond +-kQuantizedLimit cannot be encoded.
struct QuantizedLayout : layout_detail::PlanesLeaves, layout_detail::StoredChildFlags<QuantizedBoxNode> {
  static constexpr NodeLayout kId = NodeLayout::kQuantized;
  static constexpr NodeType kBoxType = NodeType::kBox32;
  using Node = QuantizedBoxNode;

  HIPRT_HD static HIPRT_FORCE_INLINE Box box(const Node& node, unsigned child) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if ((node.children >> child & 1u) == 0)
      return Box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    return Box{{dequantize(node, 0, 0, child), dequantize(node, 1, 0, child), dequantize(node, 2, 0, child)},
               {dequantize(node, 0, 1, child), dequantize(node, 1, 1, child), dequantize(node, 2, 1, child)}};
  }
  /// Sets also the bits of the slots in use and the order axis.
  HIPRT_HD static HIPRT_FORCE_INLINE bool set_boxes(Node& node, const Box (&boxes)[kBranching]) {
    return quantize(node, boxes);
  }
};

/// A leaf of a run with a kProcedural reference.
template <class Leaf> HIPRT_HD HIPRT_FORCE_INLINE const CustomLeaf& custom_leaf(const Leaf& leaf) {
  static_assert(sizeof(Leaf) == sizeof(CustomLeaf) && alignof(Leaf) == alignof(CustomLeaf));
  return reinterpret_cast<const CustomLeaf&>(leaf);
}

/// Vertex number (0-3) of corner 0, 1, 2 of triangle 0 or 1 of a leaf: (v0, v1, v2) and (v1, v3, v2).
HIPRT_HD constexpr unsigned corner_vertex(unsigned triangle, unsigned corner) {
  return triangle == 0 ? corner : corner == 0 ? 1u : corner == 1 ? 3u : 2u;
}

}  // namespace hiprt
