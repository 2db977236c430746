#pragma once
/// Rewrites a BVH file after its primitives have moved: leaves first, then every box node after its children.
/// References between records stay, except for the order of the children in a quantized node. Internal.
///
/// Four steps, each for all i before the next: LinkUpStep (nodes), MoveLeafStep (leaves), RefitNodeStep (nodes),
/// MoveBoundsStep (1).

#include <hiprt_build/encode/wide_node.h>
#include <hiprt_build/format/node_places.h>
#include <hiprt_build/refit/moved_geometry.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/math/atomic.h>

#include <bit>

namespace hiprt::build {

/// The farthest finite positions that layout half has infinite planes for: [axis] the bits of -minimum, [3 + axis] of
/// the maximum, 0 where there is none.
struct OuterPlanes {
  std::uint64_t bits[6];

  HIPRT_HD HIPRT_FORCE_INLINE void add(const Box& box) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      if (half_above(-box.min[axis]) == kHalfInfinity) raise(&bits[axis], std::bit_cast<std::uint32_t>(-box.min[axis]));
      if (half_above(box.max[axis]) == kHalfInfinity)
        raise(&bits[3 + axis], std::bit_cast<std::uint32_t>(box.max[axis]));
    }
  }
  HIPRT_HD HIPRT_FORCE_INLINE Box box() const {
    Box box{};
    for (unsigned axis = 0; axis < 3; ++axis) {
      box.min[axis] = -std::bit_cast<float>(static_cast<std::uint32_t>(bits[axis]));
      box.max[axis] = std::bit_cast<float>(static_cast<std::uint32_t>(bits[3 + axis]));
    }
    return box;
  }
};

/// The parts of a file that a refit changes, and what it needs beside them.
template <class Layout> struct RefitFile {
  using Node = typename Layout::Node;
  using Leaf = typename Layout::Leaf;
  static constexpr unsigned kArrivalBits = 3;
  static_assert(kBranching < 1u << kArrivalBits);
  static_assert(kAddressLimit / sizeof(Node) <= 1u << (32 - kArrivalBits));

  FileHeader* header;
  NodeArray<Node> nodes;
  Leaf* leaves;
  std::uint64_t first_node, first_leaf;  ///< Byte offsets in the file.
  const GeometryView* geometries;        ///< By number.
  std::uint32_t* parents;  ///< Per node: the parent's number << kArrivalBits | children that are done. Uninitialised.
  OuterPlanes* outer;      ///< 0. Layout half only.
  /// Of leaves that hold but a part of their triangles: their boxes. Else nullptr: the boxes of the triangles.
  const Box* leaf_boxes = nullptr;

  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t node(NodeRef ref) const {
    return static_cast<std::uint32_t>(nodes.places().number(ref_offset(ref) - first_node));
  }
  HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t leaf(NodeRef ref) const {
    return static_cast<std::uint32_t>((ref_offset(ref) - first_leaf) / sizeof(Leaf));
  }
  HIPRT_HD HIPRT_FORCE_INLINE unsigned box_children(std::uint32_t node) const {
    unsigned count = 0;
    for (const NodeRef ref : nodes[node].child) count += ref != kInvalidRef && is_box(ref) ? 1 : 0;
    return count;
  }

  HIPRT_HD HIPRT_FORCE_INLINE static Box leaf_box(const Leaf& leaf, bool custom) {
    if (custom) return unite(custom_leaf(leaf).box[0], custom_leaf(leaf).box[1]);
    Box box = empty_box();
    for (unsigned v = 0; v < 4; ++v) {
      const float x = Layout::coordinate(leaf, v, 0), y = Layout::coordinate(leaf, v, 1),
                  z = Layout::coordinate(leaf, v, 2);
      grow(box, Box{{x, y, z}, {x, y, z}});
    }
    return box;
  }

  /// Of what is below a reference. @pre it is done.
  HIPRT_HD HIPRT_FORCE_INLINE Box box_below(NodeRef ref) const {
    if (is_box(ref)) return node_box<Layout>(nodes[node(ref)]);
    Box box = empty_box();
    const bool custom = ref_type(ref) == NodeType::kProcedural;
    for (const Leaf* at = leaves + leaf(ref);; ++at) {
      grow(box, leaf_boxes != nullptr ? leaf_boxes[at - leaves] : leaf_box(*at, custom));
      if ((at->info.geometry_and_flags & kLastInRun) != 0) return box;
    }
  }
};

/// Step: tells the children of node i of it.
template <class Layout> struct LinkUpStep {
  RefitFile<Layout> file;

  HIPRT_HD void operator()(std::size_t i) const {
    for (const NodeRef ref : file.nodes[i].child)
      if (ref != kInvalidRef && is_box(ref))
        file.parents[file.node(ref)] = static_cast<std::uint32_t>(i) << file.kArrivalBits;
    if (i == file.node(file.header->root)) file.parents[i] = 0;
  }
};

/// Step: writes the moved primitives of leaf i.
template <class Layout> struct MoveLeafStep {
  RefitFile<Layout> file;

  HIPRT_HD void operator()(std::size_t i) const {
    typename Layout::Leaf& leaf = file.leaves[i];
    const LeafInfo& info = leaf.info;
    const GeometryView& geometry = file.geometries[info.geometry_and_flags & kGeometryMask];
    if (geometry.is_custom())
      move_boxes(reinterpret_cast<CustomLeaf&>(leaf), geometry);
    else
      move_vertices(leaf, geometry);
    if constexpr (Layout::kId == NodeLayout::kHalf) file.outer->add(file.leaf_box(leaf, geometry.is_custom()));
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE static void move_boxes(CustomLeaf& leaf, const GeometryView& customs) {
    for (unsigned k = 0; k < 2; ++k)
      if (leaf.info.primitive[k] != kInvalidId) leaf.box[k] = customs.box(leaf.info.primitive[k]);
  }
  HIPRT_HD HIPRT_FORCE_INLINE static void move_vertices(typename Layout::Leaf& leaf, const GeometryView& mesh) {
    const StoredTriangle first = stored_triangle(mesh, leaf.info, 0);
    const bool pair = leaf.info.primitive[1] != kInvalidId;
    const float* v3 = pair ? stored_triangle(mesh, leaf.info, 1).corner[1] : first.corner[2];
    for (unsigned axis = 0; axis < 3; ++axis) {
      for (unsigned v = 0; v < 3; ++v) Layout::set_coordinate(leaf, v, axis, first.corner[v][axis]);
      Layout::set_coordinate(leaf, 3, axis, v3[axis]);
    }
  }
};

/// Step: climbs from node i if it has no box nodes below it; whoever is the last to come to a node writes it.
template <class Layout> struct RefitNodeStep {
  RefitFile<Layout> file;

  HIPRT_HD void operator()(std::size_t i) const {
    auto node = static_cast<std::uint32_t>(i);
    if (file.box_children(node) != 0) return;
    const std::uint32_t root = file.node(file.header->root);
    for (;;) {
      write(node);
      if (node == root) return;
      node = file.parents[node] >> file.kArrivalBits;
      // Counted before the arrival is told: from then on another thread may be writing the node.
      const unsigned children = file.box_children(node);
      const std::uint32_t before = fetch_add_ordered(&file.parents[node], 1);
      if ((before & ((1u << file.kArrivalBits) - 1)) + 1 != children) return;
    }
  }

 private:
  HIPRT_HD void write(std::uint32_t i) const {
    typename Layout::Node& node = file.nodes[i];
    const std::uint32_t flags = Layout::child_flags(node);
    WideChild children[kBranching];
    for (unsigned c = 0; c < kBranching; ++c)
      if (node.child[c] != kInvalidRef)
        children[c] = WideChild{node.child[c], flags >> (8 * c) & 0xffu, file.box_below(node.child[c])};
    node = make_node<Layout>(children);
  }
};

/// Step: the header's bounds. @pre there is a root.
template <class Layout> struct MoveBoundsStep {
  RefitFile<Layout> file;

  HIPRT_HD void operator()(std::size_t) const {
    const Box box = file.box_below(file.header->root);
    if constexpr (Layout::kId == NodeLayout::kHalf)
      file.header->bounds = bounded(box, file.outer->box());
    else
      file.header->bounds = box;
  }
};

}  // namespace hiprt::build
