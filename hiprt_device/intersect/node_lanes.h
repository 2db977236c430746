#pragma once
/// Reads a node's planes and a leaf's coordinates four lanes at a time, for each layout.

#include <hiprt_device/format/layout.h>
#include <hiprt_device/math/lanes.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Bits 3-0: the children that exist. In layouts whose absent children have the empty box, all bits are set.
template <class Node> HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t load_present(const Node&) { return 0xfu; }
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t load_present(const QuantizedBoxNode& node) {
#if defined(__CUDA_ARCH__)
  // The comparisons that find the met children take these as operands. Bits would have to be tested first.
  const Words child = load_words(node.child);
  const auto bit = [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA { return child.word[i] != kInvalidRef ? 1u << i : 0u; };
  return bit(0) | bit(1) | bit(2) | bit(3);
#else
  return load_words(node.origin).word[3] >> 24;
#endif
}

/// The four children's planes of one axis. @param side 0 minimum, 1 maximum.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_planes(const PlanesBoxNode& node, unsigned axis, unsigned side) {
  return Lanes::load(node.plane[axis][side]);
}

template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_planes(const FloatBoxNode& node, unsigned axis, unsigned side) {
  if constexpr (Lanes::kScalar) {
    const Words words[6] = {load_words(&node.box[0].min[0]),      load_words(&node.box[0].min[0] + 4),
                            load_words(&node.box[0].min[0] + 8),  load_words(&node.box[0].min[0] + 12),
                            load_words(&node.box[0].min[0] + 16), load_words(&node.box[0].min[0] + 20)};
    const auto plane = [&](unsigned child) HIPRT_FORCE_INLINE_LAMBDA {
      const unsigned low = 6 * child + axis, high = low + 3;
      const float minimum = words[low / 4].as_float(low % 4), maximum = words[high / 4].as_float(high % 4);
      return side == 0 ? minimum : maximum;
    };
    return Lanes::set(plane(0), plane(1), plane(2), plane(3));
  } else {
    const float* first = &node.box[0].min[0] + 3 * side + axis;
    return Lanes::set(first[0], first[6], first[12], first[18]);
  }
}

template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_planes(const HalfBoxNode& node, unsigned axis, unsigned side) {
  if constexpr (Lanes::kScalar) {
    const std::uint16_t* first = node.box[0].min;
    const Words words[3] = {load_words(first), load_words(first + 8), load_words(first + 16)};
    const auto plane = [&](unsigned child) HIPRT_FORCE_INLINE_LAMBDA {
      const auto half = [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA {
        return words[i / 8].word[i / 2 % 4] >> (16 * (i % 2)) & 0xffffu;
      };
      const std::uint32_t minimum = half(6 * child + axis), maximum = half(6 * child + 3 + axis);
      return side == 0 ? minimum : maximum;
    };
    return Lanes::from_halves(plane(0), plane(1), plane(2), plane(3));
  } else {
    const std::uint16_t* first = node.box[0].min + 3 * side + axis;
    return Lanes::from_halves(first[0], first[6], first[12], first[18]);
  }
}

/// The planes in units of the node's grid.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_planes(const QuantizedBoxNode& node, unsigned axis,
                                                              unsigned side) {
  if constexpr (Lanes::kScalar) {
    const Words words = load_words(node.plane[axis < 2 ? 0 : 2][0]);
    // Values, not elements: a choice between addresses would put the words into memory.
    const std::uint32_t minimum = words.word[axis == 1 ? 2 : 0], maximum = words.word[axis == 1 ? 3 : 1];
    return Lanes::from_bytes(side == 0 ? minimum : maximum);
  } else {
    std::uint32_t bytes;
    std::memcpy(&bytes, node.plane[axis][side], sizeof(bytes));
    return Lanes::from_bytes(bytes);
  }
}

#if defined(__CUDA_ARCH__)
namespace node_lanes_detail {

/// The address of a side by one integer multiplication and addition. These run beside comparisons, selections and
/// logical instructions, which limit coherent rays. The low half of the address does not overflow: a node begins at a
/// multiple of 64.
template <bool kFar>
HIPRT_HD HIPRT_FORCE_INLINE const float* planes_of(const PlanesBoxNode& node, unsigned axis, unsigned near_side) {
  constexpr int kSide = sizeof(node.plane[0][0]);
  static_assert(alignof(PlanesBoxNode) > kSide);
  const auto address = reinterpret_cast<std::uint64_t>(&node);
  std::uint32_t low;
  asm("mad.lo.u32 %0, %1, %2, %3;"
      : "=r"(low)
      : "r"(near_side), "r"(kFar ? -kSide : kSide), "r"(static_cast<std::uint32_t>(address) + (kFar ? kSide : 0)));
  return reinterpret_cast<const PlanesBoxNode*>((address & 0xffffffff00000000u) | low)->plane[axis][0];
}

/// Near planes in the low halves of four words, far planes in the high ones.
HIPRT_HD HIPRT_FORCE_INLINE Words near_and_far(const HalfBoxNode& node, unsigned axis, unsigned near_side) {
  const std::uint16_t* first = node.box[0].min;
  const Words words[3] = {load_words(first), load_words(first + 8), load_words(first + 16)};
  const bool down = near_side != 0;
  // Of a box's three words {min x, min y}, {min z, max x}, {max y, max z}: two that have the axis.
  const std::uint32_t bytes = axis == 1 ? (down ? 0x3254u : 0x5432u) : (down ? 0x1076u : 0x7610u);
  const auto pick = [&](unsigned child) HIPRT_FORCE_INLINE_LAMBDA {
    const unsigned i = 3 * child + (axis == 2 ? 1 : 0), j = 3 * child + (axis == 0 ? 1 : 2);
    return __byte_perm(words[i / 4].word[i % 4], words[j / 4].word[j % 4], bytes);
  };
  return {{pick(0), pick(1), pick(2), pick(3)}};
}

}  // namespace node_lanes_detail

/// The planes of one axis that a ray meets first or last (kFar), of four children. @param near_side that of RaySlabs.
template <class Lanes, bool kFar, class Node>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_side(const Node& node, unsigned axis, unsigned near_side) {
  return load_planes<Lanes>(node, axis, near_side ^ (kFar ? 1u : 0u));
}
template <class Lanes, bool kFar>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_side(const PlanesBoxNode& node, unsigned axis,
                                                            unsigned near_side) {
  return Lanes::load(node_lanes_detail::planes_of<kFar>(node, axis, near_side));
}
template <class Lanes, bool kFar>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_side(const HalfBoxNode& node, unsigned axis,
                                                            unsigned near_side) {
  const Words both = node_lanes_detail::near_and_far(node, axis, near_side);
  const auto half = [&](unsigned child) HIPRT_FORCE_INLINE_LAMBDA {
    return kFar ? both.word[child] >> 16 : both.word[child] & 0xffffu;
  };
  return Lanes::from_halves(half(0), half(1), half(2), half(3));
}
#endif

/// One coordinate of a leaf's four vertices.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_coordinates(const PlanesLeaf& leaf, unsigned axis) {
  return Lanes::load(leaf.coordinate[axis]);
}

template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_coordinates(const FloatLeaf& leaf, unsigned axis) {
  if constexpr (Lanes::kScalar) {
    const float* first = leaf.vertex[0];
    const Words words[3] = {load_words(first), load_words(first + 4), load_words(first + 8)};
    const auto coordinate = [&](unsigned vertex) HIPRT_FORCE_INLINE_LAMBDA {
      const auto of = [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA { return words[i / 4].as_float(i % 4); };
      const float x = of(3 * vertex), y = of(3 * vertex + 1), z = of(3 * vertex + 2);
      return axis == 0 ? x : axis == 1 ? y : z;
    };
    return Lanes::set(coordinate(0), coordinate(1), coordinate(2), coordinate(3));
  } else {
    return Lanes::set(leaf.vertex[0][axis], leaf.vertex[1][axis], leaf.vertex[2][axis], leaf.vertex[3][axis]);
  }
}

/// The same leaf of a scene. Its coordinates are loaded again, so that they need not stay in registers.
template <class Leaf> HIPRT_HD HIPRT_FORCE_INLINE const Leaf& read_again(const Leaf& leaf) { return *forget(&leaf); }

/// Every leaf record ends with its LeafInfo.
inline constexpr std::size_t kInfoOffset = sizeof(CustomLeaf) - sizeof(LeafInfo);

/// The part that all leaves share.
/// @param record first byte of a leaf.
HIPRT_HD HIPRT_FORCE_INLINE LeafInfo load_info(const std::byte* record) {
  return std::bit_cast<LeafInfo>(load_words(record + kInfoOffset));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
