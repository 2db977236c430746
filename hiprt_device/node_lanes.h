#pragma once
/// Reads a node's planes and a leaf's coordinates four lanes at a time, for each layout.

#include <hiprt_device/format/layout.h>
#include <hiprt_device/lanes.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The four children's planes of one axis. @param side 0 minimum, 1 maximum.
template <class Lanes>
HIPRT_HD HIPRT_INLINE typename Lanes::Float load_planes(const PlanesBoxNode& node, unsigned axis, unsigned side) {
  return Lanes::load(node.plane[axis][side]);
}

template <class Lanes>
HIPRT_HD HIPRT_INLINE typename Lanes::Float load_planes(const FloatBoxNode& node, unsigned axis, unsigned side) {
  const float* first = &node.box[0].min[0] + 3 * side + axis;
  return Lanes::set(first[0], first[6], first[12], first[18]);
}

/// One coordinate of a leaf's four vertices.
template <class Lanes>
HIPRT_HD HIPRT_INLINE typename Lanes::Float load_coordinates(const PlanesLeaf& leaf, unsigned axis) {
  return Lanes::load(leaf.coordinate[axis]);
}

template <class Lanes>
HIPRT_HD HIPRT_INLINE typename Lanes::Float load_coordinates(const FloatLeaf& leaf, unsigned axis) {
  return Lanes::set(leaf.vertex[0][axis], leaf.vertex[1][axis], leaf.vertex[2][axis], leaf.vertex[3][axis]);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
