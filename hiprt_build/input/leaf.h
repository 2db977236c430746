#pragma once
/// Leaves of a tree before they are records of a file: their primitives, corners and boxes. Internal.

#include <hiprt_build/input/geometry.h>
#include <hiprt_build/tree/box.h>

#include <cstdint>
#include <cstring>

namespace hiprt::build {

/// What a leaf holds besides its lower primitive: whether there is a second one, and the rotations of both triangles.
/// Stored corner k of a triangle is the mesh's corner (k + rotation) % 3; the shared edge is v1 v2 (see LeafInfo).
struct LeafContents {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  static constexpr std::uint32_t kCustom = 3;  ///< First rotation of custom primitives.
  static constexpr std::uint32_t kMaxDistance = (1u << 28) - 2;

  std::uint32_t bits;

  HIPRT_HD static LeafContents none() { return LeafContents{kNone}; }
  /// @param distance of the second primitive's number from the first's, up to kMaxDistance; 0: there is none.
  HIPRT_HD static LeafContents make(std::uint32_t distance, std::uint32_t rotation0, std::uint32_t rotation1) {
    return LeafContents{distance << 4 | rotation1 << 2 | rotation0};
  }
  HIPRT_HD bool exists() const { return bits != kNone; }
  HIPRT_HD bool is_pair() const { return bits >> 4 != 0; }
  HIPRT_HD bool is_custom() const { return rotation0() == kCustom; }
  HIPRT_HD std::uint32_t distance() const { return bits >> 4; }
  HIPRT_HD std::uint32_t rotation0() const { return bits & 3u; }
  HIPRT_HD std::uint32_t rotation1() const { return bits >> 2 & 3u; }
};

/// The primitives of a leaf.
struct LeafPrimitives {
  std::uint32_t primitive;  ///< The lower one, in the numbering of all.
  LeafContents contents;
};

/// A box that holds a leaf's primitives, or a part of them. What trees are built over.
struct alignas(32) Reference {
  Box box;
  LeafContents contents;
  std::uint32_t primitive;  ///< The lower one, in the numbering of all.
};
static_assert(sizeof(Reference) == 32);

/// @return a part of what @p whole holds.
HIPRT_HD HIPRT_FORCE_INLINE Reference part_of(const Reference& whole, const Box& box) {
  return Reference{box, whole.contents, whole.primitive};
}

/// Loads the box that a record of 32 bytes (Reference, LinkedNode, DepthFirstNode) begins with. The fourth lanes are
/// coordinates too: the integers behind a box would be denormal floats, and CPUs calculate with these a hundred times
/// as slowly.
template <class Record> SimdBox simd_box(const Record& record) {
  static_assert(sizeof(Record) == 32);
  SimdBox box;
  const auto* bytes = reinterpret_cast<const char*>(&record);
  std::memcpy(&box.min, bytes, sizeof(box.min));
  Float4 last_four;
  std::memcpy(&last_four, bytes + sizeof(float[2]), sizeof(last_four));
  box.max = Float4{last_four[1], last_four[2], last_four[3], last_four[0]};
  return box;
}

HIPRT_HD HIPRT_FORCE_INLINE Float4 to_float4(const Point& p) { return Float4{p.x[0], p.x[1], p.x[2], 0.0f}; }

/// @param first the lower triangle, in its mesh.
HIPRT_HD HIPRT_FORCE_INLINE LeafCorners leaf_corners(const GeometryView& mesh, std::uint32_t first,
                                                     LeafContents contents) {
  LeafCorners corners;
  for (unsigned k = 0; k < 3; ++k) corners.v[k] = corner(mesh, first, (k + contents.rotation0()) % 3);
  corners.v[3] =
      contents.is_pair() ? corner(mesh, first + contents.distance(), (1 + contents.rotation1()) % 3) : corners.v[2];
  return corners;
}

/// @param leaf LeafPrimitives or Reference. @pre triangles.
template <class Leaf>
HIPRT_HD HIPRT_FORCE_INLINE LeafCorners leaf_corners(const GeometryTable& geometries, const Leaf& leaf) {
  const GeometryView& mesh = geometries[geometries.find(leaf.primitive)];
  return leaf_corners(mesh, leaf.primitive - mesh.first, leaf.contents);
}

/// The box of a leaf's primitives. @param first the lower one, in its geometry.
HIPRT_HD HIPRT_FORCE_INLINE Box leaf_box(const GeometryView& geometry, std::uint32_t first, LeafContents contents) {
  if (geometry.is_custom()) {
    const Box box = geometry.box(first);
    return contents.is_pair() ? unite(box, geometry.box(first + contents.distance())) : box;
  }
  const LeafCorners corners = leaf_corners(geometry, first, contents);
  Box box = empty_box();
  for (const Point& v : corners.v) grow(box, v);
  return box;
}

/// The same with the zeros of SimdBox::add().
inline SimdBox leaf_simd_box(const GeometryTable& geometries, const LeafPrimitives& leaf) {
  const GeometryView& geometry = geometries[geometries.find(leaf.primitive)];
  const std::uint32_t first = leaf.primitive - geometry.first;
  SimdBox box;
  if (geometry.is_custom()) {
    box.add(to_simd(geometry.box(first)));
    if (leaf.contents.is_pair()) box.add(to_simd(geometry.box(first + leaf.contents.distance())));
  } else {
    for (const Point& v : leaf_corners(geometry, first, leaf.contents).v) box.add(to_float4(v));
  }
  return box;
}

}  // namespace hiprt::build
