#pragma once
/// Nodes of eight children that a host makes of a file's nodes (host_scene.h). They are not part of a file.

#include <hiprt_device/format/layout.h>

namespace hiprt {

/// Children of a WideNode.
inline constexpr unsigned kWideBranching = 8;
/// Leaves of two triangles that one reference of a WideNode may name.
inline constexpr unsigned kMostWideLeaves = 4;

/// plane[axis][side][child], side 0 = minimum, 1 = maximum. Absent children have the empty box.
///
/// A child reference of type kBox32 has the number of a WideNode where others have the offset. One of types kTriangle0
/// to kTriangle3 names one to four leaves of the file, side by side; their kLastInRun does not count. One of type
/// kProcedural names a longer run of triangle leaves, up to the one with kLastInRun.
struct alignas(64) WideNode {
  float plane[3][2][kWideBranching];
  NodeRef child[kWideBranching];
  std::uint32_t reserved[kWideBranching];
};
static_assert(sizeof(WideNode) == 256);

/// The layout of WideNodes over the leaves of layout planes. For hosts with WideLanes, and scenes with a HostScene.
struct WideLayout : layout_detail::PlanesLeaves {
  static constexpr NodeLayout kId = NodeLayout::kPlanes;
  static constexpr NodeType kBoxType = NodeType::kBox32;
  static constexpr bool kHasChildFlags = false;
  using Node = WideNode;
};

/// Whether a layout is made by the host, and its references name WideNodes.
template <class Layout> inline constexpr bool kIsWide = false;
template <> inline constexpr bool kIsWide<WideLayout> = true;

/// The reference to a WideNode.
HIPRT_HD constexpr NodeRef wide_ref(std::uint32_t number) {
  return make_ref(std::uint64_t{number} * kNodeGranularity, NodeType::kBox32);
}
/// @pre wide_ref() has made the reference
HIPRT_HD constexpr std::uint32_t wide_number(NodeRef ref) { return ref >> 3; }
/// @param count 1 to kMostWideLeaves.
HIPRT_HD constexpr NodeRef wide_leaves(std::uint64_t byte_offset, unsigned count) {
  return make_ref(byte_offset, NodeType::kTriangle0) + (count - 1);
}
/// @pre wide_leaves() has made the reference
HIPRT_HD constexpr unsigned wide_leaf_count(NodeRef ref) { return (ref & 3u) + 1; }
HIPRT_HD constexpr bool is_long_run(NodeRef ref) { return ref_type(ref) == NodeType::kProcedural; }

}  // namespace hiprt
