#pragma once
/// Closest points by trying every triangle, and points to ask for.

#include <hiprt_device/query/nearest_points.h>
#include <tests/amount.h>
#include <tests/oracle/point_triangle.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/scenes.h>

namespace hiprt::checks {

inline Vec3D vec3d(const Position& p) { return {p[0], p[1], p[2]}; }

/// All triangles within the query's distance, in order. The library computes each distance: results are the same bits.
template <class Real>
std::vector<BasicClosestPoint<Real>> try_all(const std::vector<Mesh>& meshes, const BasicPointQuery<Real>& query) {
  std::vector<BasicClosestPoint<Real>> result;
  const double farthest = query.max_distance;
  for (std::uint32_t geometry = 0; geometry < meshes.size(); ++geometry) {
    const Mesh& mesh = meshes[geometry];
    if ((mesh.mask & query.mask) == 0) continue;
    for (std::uint32_t primitive = 0; primitive < mesh.triangles.size(); ++primitive) {
      const Corners c = corners(mesh, primitive);
      if (is_dropped(c)) continue;
      const Vec3D corner[3] = {vec3d(c.p0), vec3d(c.p1), vec3d(c.p2)};
      const TrianglePoint near = closest_on_triangle(corner, Vec3D(query.point));
      if (!(near.squared <= farthest * farthest)) continue;
      result.push_back({near.squared, BasicVec3<Real>(near.point), static_cast<Real>(near.u), static_cast<Real>(near.v),
                        geometry, primitive, near.feature});
    }
  }
  std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return precedes(a, b); });
  return result;
}

/// Equal bit for bit.
template <class Real> bool same_point(const BasicClosestPoint<Real>& a, const BasicClosestPoint<Real>& b) {
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return bits(a.distance_squared) == bits(b.distance_squared) && a.geometry == b.geometry &&
         a.primitive == b.primitive && a.feature == b.feature && a.u == b.u && a.v == b.v && a.point == b.point;
}

template <class Real> std::string text(const BasicClosestPoint<Real>& p) {
  char line[160];
  std::snprintf(line, sizeof(line), "squared %.17g geometry %u primitive %u feature %u u %g v %g", p.distance_squared,
                p.geometry, p.primitive, static_cast<unsigned>(p.feature), double{p.u}, double{p.v});
  return line;
}

/// On, near and far from the surface; some at vertices or edges exactly.
inline Vec3 point_near(const Mesh& mesh, Random& random, double scale, const Double3& offset) {
  const Double3 on = target_point(mesh, random), away = random.on_sphere();
  const unsigned kind = random.below(5);
  const double far = kind == 0 ? 0.0 : kind == 1 ? random.log_uniform(1e-9, 1e-2) : random.log_uniform(1e-2, 10);
  Double3 p{};
  for (std::size_t k = 0; k < 3; ++k)
    p[k] = kind == 4 ? offset[k] + 10 * scale * away[k] : on[k] + far * scale * away[k];
  return vec3(rounded(p));
}

template <class Layout> struct ArrayPolicies : WithLayout<Layout> { using Lanes = ArrayLanes; };

/// Calls look(policies) for the policies that differ in what point queries use, in the scene's layout.
template <class Look> void with_policies(const Scene& scene, Look&& look) {
  dispatch_layout(scene.traced.layout, [&](auto layout) {
    look(WithLayout<decltype(layout)>{});
    look(ArrayPolicies<decltype(layout)>{});
  });
}

}  // namespace hiprt::checks
