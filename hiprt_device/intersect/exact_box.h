#pragma once
/// Whether a triangle and a box have a common point, decided exactly for all finite floats.
///
/// The axes that suffice are those of the box, the triangle's normal, and the cross products of edges with the axes
/// (Akenine-Moeller 2001). A cross product with an axis is a line in the plane across that axis. So all decisions are
/// comparisons of floats, or signs of determinants, which are computed exactly (math/exact.h).

#include <hiprt_device/format/quantize.h>
#include <hiprt_device/math/exact.h>
#include <hiprt_device/math/vec.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace exact_box_detail {

/// Corners in memory: axes vary.
struct Corners {
  float corner[3][3];
};

/// The sign of the area of a, b, p in the plane of axes i and j: 1 if counter-clockwise.
HIPRT_HD inline int side(const float* a, const float* b, float p_i, float p_j, unsigned i, unsigned j) {
  ExactSum<6> sum;
  const auto add = [&](float x, float y) { sum.add(static_cast<double>(x) * static_cast<double>(y)); };
  add(a[i], b[j]);
  add(-a[j], b[i]);
  add(b[i], p_j);
  add(-b[j], p_i);
  add(p_i, a[j]);
  add(-p_j, a[i]);
  return sum.sign();
}

/// Whether an edge's line in the plane across axis @p k separates the box from the triangle.
HIPRT_HD inline bool is_apart_across(const Box& box, const Corners& of, unsigned k) {
  const unsigned i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
  HIPRT_NO_UNROLL
  for (unsigned edge = 0; edge < 3; ++edge) {
    const float* a = of.corner[edge];
    const float* b = of.corner[edge == 2 ? 0 : edge + 1];
    const float* c = of.corner[edge == 0 ? 2 : edge - 1];
    const bool falls_i = b[j] > a[j], grows_j = b[i] > a[i];  // How the area depends on the point.
    const int least = side(a, b, falls_i ? box.max[i] : box.min[i], grows_j ? box.min[j] : box.max[j], i, j);
    const int most = side(a, b, falls_i ? box.min[i] : box.max[i], grows_j ? box.max[j] : box.min[j], i, j);
    if (least <= 0 && most >= 0) continue;
    const int own = side(a, b, c[i], c[j], i, j);
    if ((least > 0 && own <= 0) || (most < 0 && own >= 0)) return true;
  }
  return false;
}

/// The sign of det[b - a, c - a, p - a].
HIPRT_HD inline int side_of_plane(const Corners& of, const float* p) {
  const float *a = of.corner[0], *b = of.corner[1], *c = of.corner[2];
  ExactSum<48> sum;
  sum.add_determinant(b, c, p);
  sum.add_determinant(c, a, p);
  sum.add_determinant(a, b, p);
  sum.add_determinant(b, a, c);
  return sum.sign();
}

HIPRT_HD inline bool is_apart_from_plane(const Box& box, const Corners& of) {
  float low[3], high[3];
  for (unsigned k = 0; k < 3; ++k) {
    const unsigned i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
    const float* c = of.corner[2];
    const bool grows = side(of.corner[0], of.corner[1], c[i], c[j], i, j) > 0;
    low[k] = grows ? box.min[k] : box.max[k];
    high[k] = grows ? box.max[k] : box.min[k];
  }
  return side_of_plane(of, low) > 0 || side_of_plane(of, high) < 0;
}

}  // namespace exact_box_detail

/// Whether box and triangle have a common point: their boundaries belong to them.
/// @pre all finite, or the box is empty.
HIPRT_HD inline bool box_meets_triangle(const Box& box, const Vec3 (&corner)[3]) {
  using namespace exact_box_detail;
  if (is_empty(box)) return false;
  Corners of;
  for (unsigned k = 0; k < 3; ++k) {
    of.corner[k][0] = corner[k].x;
    of.corner[k][1] = corner[k].y;
    of.corner[k][2] = corner[k].z;
  }
  for (unsigned k = 0; k < 3; ++k) {
    const float a = of.corner[0][k], b = of.corner[1][k], c = of.corner[2][k];
    if ((a > box.max[k] && b > box.max[k] && c > box.max[k]) || (a < box.min[k] && b < box.min[k] && c < box.min[k]))
      return false;
  }
  for (unsigned k = 0; k < 3; ++k)
    if (is_apart_across(box, of, k)) return false;
  return !is_apart_from_plane(box, of);
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
