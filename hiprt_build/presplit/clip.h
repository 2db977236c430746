#pragma once
/// Bounds of the two parts of a leaf's triangles on either side of a plane. Internal.

#include <hiprt_build/input/leaf.h>
#include <hiprt_build/tree/box.h>

#include <bit>
#include <cstdint>

namespace hiprt::build {

struct SplitBounds {
  SimdBox left, right;
};

namespace clip_detail {

/// As std::nextafter(x, infinity).
HIPRT_HD HIPRT_FORCE_INLINE float next_above(float x) {
  if (!(x < SimdBox::kInfinity)) return x;
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return std::bit_cast<float>(x == 0.0f ? 1u : x > 0.0f ? bits + 1 : bits - 1);
}
HIPRT_HD HIPRT_FORCE_INLINE float next_below(float x) { return -next_above(-x); }

/// Adds the point of edge a b in the plane, rounded outwards on the other axes.
HIPRT_HD HIPRT_FORCE_INLINE void add_crossing(const Point& a, const Point& b, unsigned axis, float plane,
                                              SplitBounds& result) {
  const double start = static_cast<double>(a.x[axis]);
  const double part = (static_cast<double>(plane) - start) / (static_cast<double>(b.x[axis]) - start);
  Float4 low{}, high{};
  for (unsigned k = 0; k < 3; ++k) {
    const double from = static_cast<double>(a.x[k]), x = from + part * (static_cast<double>(b.x[k]) - from);
    const float rounded = static_cast<float>(x);
    low[static_cast<int>(k)] = k == axis ? plane : next_below(rounded);
    high[static_cast<int>(k)] = k == axis ? plane : next_above(rounded);
  }
  result.left.add(low);
  result.left.add(high);
  result.right.add(low);
  result.right.add(high);
}

HIPRT_HD HIPRT_FORCE_INLINE void add_triangle(const Point (&v)[3], unsigned axis, float plane, SplitBounds& result) {
  for (unsigned k = 0; k < 3; ++k) {
    const Point &a = v[k], &b = v[(k + 1) % 3];
    if (a.x[axis] <= plane) result.left.add(to_float4(a));
    if (a.x[axis] >= plane) result.right.add(to_float4(a));
    if ((a.x[axis] < plane && b.x[axis] > plane) || (a.x[axis] > plane && b.x[axis] < plane))
      add_crossing(a, b, axis, plane, result);
  }
}

/// The common part; an axis without any keeps the limit's.
HIPRT_HD HIPRT_FORCE_INLINE SimdBox intersect(const SimdBox& box, const SimdBox& limit) {
  const Float4 min = max4(box.min, limit.min), max = min4(box.max, limit.max);
  return SimdBox{where_not_above(min, max, min, limit.min), where_not_above(min, max, max, limit.max)};
}

}  // namespace clip_detail

/// @param pair whether there are two triangles.
/// @param box bounds of the part of them that is to be split: the results stay inside.
HIPRT_HD HIPRT_FORCE_INLINE SplitBounds split_bounds(const LeafCorners& corners, bool pair, const SimdBox& box,
                                                     unsigned axis, float plane) {
  const Point(&v)[4] = corners.v;
  SplitBounds result;
  clip_detail::add_triangle({v[0], v[1], v[2]}, axis, plane, result);
  if (pair) clip_detail::add_triangle({v[1], v[3], v[2]}, axis, plane, result);
  result.left = clip_detail::intersect(result.left, box);
  result.right = clip_detail::intersect(result.right, box);
  return result;
}

/// @param leaf LeafPrimitives or Reference. @pre triangles.
template <class Leaf>
HIPRT_HD HIPRT_FORCE_INLINE SplitBounds split_bounds(const GeometryTable& geometries, const Leaf& leaf,
                                                     const SimdBox& box, unsigned axis, float plane) {
  return split_bounds(leaf_corners(geometries, leaf), leaf.contents.is_pair(), box, axis, plane);
}

}  // namespace hiprt::build
