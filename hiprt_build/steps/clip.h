#pragma once
/// Bounds of the two parts of a leaf's triangles on either side of a plane. Internal.

#include <hiprt_build/steps/geometry.h>

#include <cmath>

namespace hiprt::build {

struct SplitBounds {
  Aabb left, right;
};

namespace clip_detail {

/// Adds the point of edge a b in the plane, rounded outwards on the other axes.
inline void add_crossing(const Position& a, const Position& b, unsigned axis, float plane, SplitBounds& result) {
  const double start = static_cast<double>(a[axis]);
  const double part = (static_cast<double>(plane) - start) / (static_cast<double>(b[axis]) - start);
  Float4 low{}, high{};
  for (unsigned k = 0; k < 3; ++k) {
    const double from = static_cast<double>(a[k]), x = from + part * (static_cast<double>(b[k]) - from);
    const float rounded = static_cast<float>(x);
    low[k] = k == axis ? plane : std::nextafter(rounded, -Aabb::kInfinity);
    high[k] = k == axis ? plane : std::nextafter(rounded, Aabb::kInfinity);
  }
  for (Aabb* side : {&result.left, &result.right}) {
    side->add(low);
    side->add(high);
  }
}

inline void add_triangle(const std::array<Position, 4>& v, const std::array<unsigned, 3>& corner, unsigned axis,
                         float plane, SplitBounds& result) {
  for (unsigned k = 0; k < 3; ++k) {
    const Position &a = v[corner[k]], &b = v[corner[(k + 1) % 3]];
    if (a[axis] <= plane) result.left.add(to_float4(a));
    if (a[axis] >= plane) result.right.add(to_float4(a));
    if ((a[axis] < plane && b[axis] > plane) || (a[axis] > plane && b[axis] < plane))
      add_crossing(a, b, axis, plane, result);
  }
}

/// The common part; an axis without any keeps the limit's.
inline Aabb intersect(Aabb box, const Aabb& limit) {
  box.min = max4(box.min, limit.min);
  box.max = min4(box.max, limit.max);
  for (int axis = 0; axis < 3; ++axis)
    if (!(box.min[axis] <= box.max[axis])) box.min[axis] = limit.min[axis], box.max[axis] = limit.max[axis];
  return box;
}

}  // namespace clip_detail

/// @pre the group is of triangles.
/// @param box bounds of the part of the group that is to be split: the results stay inside.
inline SplitBounds split_bounds(const PrimitiveSoup& soup, const PrimitiveGroup& group, const Aabb& box, unsigned axis,
                                float plane) {
  const std::array<Position, 4> v = group.vertices(soup);
  SplitBounds result;
  clip_detail::add_triangle(v, {0, 1, 2}, axis, plane, result);
  if (group.is_pair()) clip_detail::add_triangle(v, {1, 3, 2}, axis, plane, result);
  result.left = clip_detail::intersect(result.left, box);
  result.right = clip_detail::intersect(result.right, box);
  return result;
}

}  // namespace hiprt::build
