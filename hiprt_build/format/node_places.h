#pragma once
/// Where the box nodes of a file are, by their numbers.
///
/// In layout planes 64 bytes are unused after every kNodesPerBlock nodes. So half of the nodes begin in the middle of
/// 128 bytes. GPUs of NVIDIA read the same part of many nodes at a time, and these parts are in more banks of the cache
/// (decision 0029).

#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/node.h>

namespace hiprt {

inline constexpr unsigned kNodesPerBlock = 64;

/// Positions in section kNodes of a file, in bytes from the section's first.
class NodePlaces {
 public:
  /// What writers do in this version.
  HIPRT_HD static constexpr bool has_gaps(NodeLayout layout) { return layout == NodeLayout::kPlanes; }

  NodePlaces() = default;
  /// @param node_size bytes of a node: 64 or 128. @param gaps only with 128.
  HIPRT_HD constexpr NodePlaces(std::uint64_t node_size, bool gaps)
      : units_(static_cast<std::uint32_t>(node_size / kUnit)), gaps_(gaps ? 1u : 0u) {}
  /// @param entry of kNodes, in a file that open_buffer() accepts.
  HIPRT_HD constexpr NodePlaces(const SectionEntry& entry, NodeLayout layout)
      : NodePlaces(has_gaps(layout) ? sizeof(PlanesBoxNode) : entry.stride, has_gaps(layout) && entry.stride == kUnit) {
  }

  HIPRT_HD constexpr bool has_gaps() const { return gaps_ != 0; }
  HIPRT_HD constexpr std::uint64_t offset(std::uint64_t number) const {
    return (number * units_ + number / kNodesPerBlock * gaps_) * kUnit;
  }
  /// @param offset of a byte of a node, below kAddressLimit.
  HIPRT_HD constexpr std::uint32_t number(std::uint64_t offset) const {
    return number_at(static_cast<std::uint32_t>(offset / kUnit));
  }
  /// Whether a node of a section of @p nodes nodes begins at @p offset, below kAddressLimit.
  HIPRT_HD constexpr bool is_node(std::uint64_t offset, std::uint64_t nodes) const {
    const std::uint32_t found = number(offset);
    return found < nodes && this->offset(found) == offset;
  }

  /// Gaps of a section of @p nodes nodes.
  HIPRT_HD constexpr std::uint64_t gaps(std::uint64_t nodes) const {
    return has_gaps() && nodes != 0 ? (nodes - 1) / kNodesPerBlock : 0;
  }
  /// Stride and count of a section of @p nodes nodes. A section with a gap has the gap's size as its stride.
  HIPRT_HD constexpr std::uint64_t stride(std::uint64_t nodes) const {
    return gaps(nodes) != 0 ? kUnit : units_ * kUnit;
  }
  HIPRT_HD constexpr std::uint64_t count(std::uint64_t nodes) const {
    return nodes == 0 ? 0 : (offset(nodes - 1) / kUnit + units_) / (stride(nodes) / kUnit);
  }
  /// Nodes of a section with such a stride and count.
  HIPRT_HD constexpr std::uint64_t nodes(const SectionEntry& entry) const {
    return has_gaps() && entry.stride == kUnit ? number_at(entry.count) : entry.count;
  }

 private:
  static constexpr std::uint64_t kUnit = kNodeGranularity;
  /// Units of a block and the gap behind it.
  static constexpr unsigned kBlock = kNodesPerBlock * sizeof(PlanesBoxNode) / kUnit + 1;

  /// The number of the node with a unit, or of the next node if the unit is a gap.
  template <class Unit> HIPRT_HD constexpr Unit number_at(Unit unit) const {
    if (gaps_ == 0) return units_ == 1 ? unit : unit / 2;
    return unit / kBlock * kNodesPerBlock + unit % kBlock / 2;
  }

  std::uint32_t units_ = 1, gaps_ = 0;
};

/// The box nodes of a file as an array.
/// @tparam Node may be const.
template <class Node> class NodeArray {
 public:
  using Byte = std::conditional_t<std::is_const_v<Node>, const std::byte, std::byte>;

  NodeArray() = default;
  /// @param first byte of section kNodes.
  HIPRT_HD constexpr NodeArray(Byte* first, NodePlaces places) : first_(first), places_(places) {}
  /// From an array of nodes that may change.
  template <class Other>
  requires(std::is_same_v<const Other, Node> && !std::is_const_v<Other>)
      HIPRT_HD NodeArray(const NodeArray<Other>& other)
      : first_(other.first()), places_(other.places()) {}

  HIPRT_HD HIPRT_FORCE_INLINE Node& operator[](std::uint64_t number) const {
    return *reinterpret_cast<Node*>(first_ + places_.offset(number));
  }
  HIPRT_HD Byte* first() const { return first_; }
  HIPRT_HD const NodePlaces& places() const { return places_; }
  /// Zeroes the gap behind block @p block. @pre another block follows it
  HIPRT_HD void clear_gap(std::uint64_t block) const requires(!std::is_const_v<Node>) {
    auto* gap =
        reinterpret_cast<std::uint64_t*>(first_ + places_.offset((block + 1) * kNodesPerBlock) - kNodeGranularity);
    for (unsigned i = 0; i < kNodeGranularity / sizeof(*gap); ++i) gap[i] = 0;
  }

 private:
  Byte* first_ = nullptr;
  NodePlaces places_;
};

}  // namespace hiprt
