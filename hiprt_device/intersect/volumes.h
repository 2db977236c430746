#pragma once
/// Convex volumes, and whether a triangle is certainly apart from one.
///
/// Two convex bodies are apart if their shadows along some axis are. Any axis proves it. The axes that suffice are the
/// normals of faces and the cross products of edges (Gottschalk, Lin, Manocha 1996). They are computed in double; a
/// rounded axis proves as much as an exact one, if the gap is larger than the rounding of the shadows.

#include <hiprt_device/format/node.h>
#include <hiprt_device/format/quantize.h>
#include <hiprt_device/intersect/point_triangle.h>

namespace hiprt {

/// A box around @p center with half edges in any directions, at right angles or not.
struct OrientedBox {
  Vec3 center{0};
  Vec3 half_edge[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
};
/// The points within a radius; 0 or more.
struct SphereVolume {
  Vec3 center{0};
  float radius = 0.0f;
};
/// The hull of a near and a far face, each of four corners in the same order around. A camera's view, for example.
struct Frustum {
  Vec3 near_corner[4], far_corner[4];
};
/// A triangle as a volume without thickness.
struct TriangleVolume {
  Vec3 corner[3];
};

inline namespace HIPRT_ISA_NAMESPACE {

/// A convex volume by its corners, and the directions of its faces and edges.
struct ConvexVolume {
  Vec3D origin;     ///< Its first corner.
  Vec3D corner[8];  ///< From the origin.
  unsigned corners = 0;
  Vec3D normal[6];  ///< Of any length, and outwards or inwards; 0 says nothing.
  unsigned normals = 0;
  Vec3D edge[6];
  unsigned edges = 0;
  bool is_aligned = false;  ///< It is a box along the axes.
};

namespace volume_detail {
using point_detail::cross, point_detail::dot;

HIPRT_HD inline void add_normals(ConvexVolume& volume, const Vec3D (&edge)[3]) {
  for (unsigned k = 0; k < 3; ++k) {
    volume.normal[k] = cross(edge[k == 2 ? 0 : k + 1], edge[k == 0 ? 2 : k - 1]);
    volume.edge[k] = edge[k];
  }
  volume.normals = volume.edges = 3;
}

HIPRT_HD inline void settle(ConvexVolume& volume) {
  volume.origin = volume.corner[0];
  for (unsigned k = 0; k < volume.corners; ++k) volume.corner[k] = volume.corner[k] - volume.origin;
}

/// The shadow of a body along an axis.
struct Shadow {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  double size = 0.0;  ///< The largest sum of magnitudes; its rounding is 3 units of 2^-53 of that.

  HIPRT_HD HIPRT_FORCE_INLINE void add(const Vec3D& axis, const Vec3D& corner) {
    const double at = dot(axis, corner);
    low = at < low ? at : low;
    high = at > high ? at : high;
    size = max_of(size, absolute(axis.x * corner.x) + absolute(axis.y * corner.y) + absolute(axis.z * corner.z));
  }
};

/// Whether the shadows are certainly apart. The triangle is given from the volume's origin.
HIPRT_HD HIPRT_FORCE_INLINE bool is_apart_along(const Vec3D& axis, const ConvexVolume& volume,
                                                const Vec3D (&triangle)[3], double moved) {
  Shadow one, other;
  HIPRT_NO_UNROLL
  for (unsigned k = 0; k < volume.corners; ++k) one.add(axis, volume.corner[k]);
  for (unsigned k = 0; k < 3; ++k) other.add(axis, triangle[k]);
  const double rounding = fused_multiply_add(0x1p-50, one.size + other.size, 2.0 * moved * point_detail::size(axis));
  return one.low - other.high > rounding || other.low - one.high > rounding;
}

}  // namespace volume_detail

/// The hull of a volume.
HIPRT_HD inline ConvexVolume convex(const Box& box) {
  ConvexVolume volume;
  for (unsigned k = 0; k < 8; ++k)
    volume.corner[k] = Vec3D((k & 1u) != 0 ? box.max[0] : box.min[0], (k & 2u) != 0 ? box.max[1] : box.min[1],
                             (k & 4u) != 0 ? box.max[2] : box.min[2]);
  volume.corners = is_empty(box) ? 0 : 8;
  volume.is_aligned = true;
  volume_detail::add_normals(volume, {Vec3D(1, 0, 0), Vec3D(0, 1, 0), Vec3D(0, 0, 1)});
  volume_detail::settle(volume);
  return volume;
}
HIPRT_HD inline ConvexVolume convex(const OrientedBox& box) {
  ConvexVolume volume;
  const Vec3D edge[3] = {Vec3D(box.half_edge[0]), Vec3D(box.half_edge[1]), Vec3D(box.half_edge[2])};
  for (unsigned k = 0; k < 8; ++k)
    volume.corner[k] =
        ((Vec3D(box.center) + ((k & 1u) != 0 ? edge[0] : -edge[0])) + ((k & 2u) != 0 ? edge[1] : -edge[1])) +
        ((k & 4u) != 0 ? edge[2] : -edge[2]);
  volume.corners = 8;
  volume_detail::add_normals(volume, edge);
  volume_detail::settle(volume);
  return volume;
}
HIPRT_HD inline ConvexVolume convex(const Frustum& frustum) {
  using volume_detail::cross;
  ConvexVolume volume;
  for (unsigned k = 0; k < 4; ++k) {
    volume.corner[k] = Vec3D(frustum.near_corner[k]);
    volume.corner[4 + k] = Vec3D(frustum.far_corner[k]);
  }
  const Vec3D(&p)[8] = volume.corner;
  volume.corners = 8;
  // The longer of a face's edges are those of the far end.
  const Vec3D across = p[5] - p[4], up = p[7] - p[4];
  volume.normal[0] = cross(across, up);
  volume.normal[1] = cross(p[1] - p[0], p[3] - p[0]);
  for (unsigned k = 0; k < 4; ++k) {
    const unsigned next = k == 3 ? 0 : k + 1;
    volume.edge[k] = p[4 + k] - p[k];
    volume.normal[2 + k] = cross(p[4 + next] - p[4 + k], volume.edge[k]);
  }
  volume.edge[4] = across;
  volume.edge[5] = up;
  volume.normals = volume.edges = 6;
  volume_detail::settle(volume);
  return volume;
}
HIPRT_HD inline ConvexVolume convex(const TriangleVolume& triangle) {
  using volume_detail::cross;
  ConvexVolume volume;
  for (unsigned k = 0; k < 3; ++k) volume.corner[k] = Vec3D(triangle.corner[k]);
  for (unsigned k = 0; k < 3; ++k) volume.edge[k] = volume.corner[k == 2 ? 0 : k + 1] - volume.corner[k];
  volume.normal[0] = cross(volume.edge[0], volume.edge[1]);
  for (unsigned k = 0; k < 3; ++k) volume.normal[1 + k] = cross(volume.normal[0], volume.edge[k]);
  volume.corners = volume.edges = 3;
  volume.normals = 4;
  volume_detail::settle(volume);
  return volume;
}

/// Whether a triangle is certainly apart from a volume. False if they touch, overlap, or are closer than rounding.
/// @param moved how far the triangle's corners may be from where they are, per axis.
HIPRT_HD inline bool is_apart(const ConvexVolume& volume, const Vec3D (&triangle)[3], double moved = 0.0) {
  using namespace volume_detail;
  const Vec3D corner[3] = {triangle[0] - volume.origin, triangle[1] - volume.origin, triangle[2] - volume.origin};
  const Vec3D edge[3] = {corner[1] - corner[0], corner[2] - corner[1], corner[0] - corner[2]};
  const Vec3D normal = cross(edge[0], edge[1]);
  const auto apart = [&](const Vec3D& axis) { return is_apart_along(axis, volume, corner, moved); };
  if (volume.corners == 0 || apart({1, 0, 0}) || apart({0, 1, 0}) || apart({0, 0, 1})) return true;
  for (unsigned k = 0; k < volume.normals; ++k)
    if (apart(volume.normal[k])) return true;
  if (apart(normal)) return true;
  for (unsigned i = 0; i < 3; ++i) {
    if (apart(cross(normal, edge[i]))) return true;
    for (unsigned k = 0; k < volume.edges; ++k)
      if (apart(cross(edge[i], volume.edge[k]))) return true;
  }
  return false;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
