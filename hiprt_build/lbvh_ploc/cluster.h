#pragma once
/// Subtrees that wait to be joined, and which of them should be. Internal.

#include <hiprt_build/tree/binary_tree.h>

#include <bit>
#include <span>

namespace hiprt::build {

/// A root of a subtree that is not joined yet. Of its leaves' numbers one is not yet a node's: the free one. Joining
/// two frees one of both and uses up the other, so that nodes are numbered without counting.
struct alignas(32) Cluster {
  Box box;
  LinkedRef ref;
  std::uint32_t free;
};
static_assert(sizeof(Cluster) == 32);

HIPRT_HD HIPRT_FORCE_INLINE Cluster leaf_cluster(const Box& box, std::uint32_t leaf) {
  return Cluster{box, leaf | kLinkedLeaf, leaf};
}

/// A new node over both. It is numbered from 1 on: leaf 0 stays free.
/// @param left comes before @p right in the order of clusters.
template <class Tree>
HIPRT_HD HIPRT_FORCE_INLINE Cluster join(const Tree& tree, const Cluster& left, const Cluster& right) {
  const Box box = unite(left.box, right.box);
  tree.join(right.free, left.ref, right.ref, box);
  return Cluster{box, right.free, left.free};
}

/// Half the area of both together. @pre no number is NaN.
/// Devices have one instruction for the smaller or larger of two numbers. Of two zeros it may choose another one than
/// unite(), which only changes the sign of a zero area.
HIPRT_HD HIPRT_FORCE_INLINE float joint_half_area(const Box& a, const Box& b) {
#if HIPRT_DEVICE_CODE
  float edges[3];
  for (unsigned axis = 0; axis < 3; ++axis)
    edges[axis] = fmaxf(a.max[axis], b.max[axis]) - fminf(a.min[axis], b.min[axis]);
  return half_area(edges[0], edges[1], edges[2]);
#else
  return half_area(unite(a, b));
#endif
}

/// How near the clusters at positions @p i and @p j are: by their joint area, ties by i ^ j, which joins equal boxes
/// evenly. The number is the same from both sides, and the low bits are i ^ j: so of all clusters the nearest two
/// choose each other.
HIPRT_HD HIPRT_FORCE_INLINE std::uint64_t nearness(const Box& a, const Box& b, std::uint32_t i, std::uint32_t j) {
  // The sign is 0; an area that is not a number comes last.
  const std::uint32_t area = std::bit_cast<std::uint32_t>(joint_half_area(a, b)) & 0x7fffffffu;
  return std::uint64_t{area} << 32 | (i ^ j);
}

/// The same in 32 bits, for positions below 32: 19 bits of the area's fraction are kept.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t short_nearness(const Box& a, const Box& b, std::uint32_t i, std::uint32_t j) {
  const std::uint64_t exact = nearness(a, b, i, j);
  return static_cast<std::uint32_t>(exact >> 36) << 5 | (i ^ j);
}

}  // namespace hiprt::build
