#pragma once
/// Closest and any hit by an exact test of every triangle: the result of a tracer without rounding.

#include <tests/oracle/mesh.h>
#include <tests/oracle/ray_triangle.h>

#include <span>

namespace hiprt::oracle {

inline Corners corners(const Mesh& mesh, std::size_t triangle) {
  const build::Triangle& t = mesh.triangles[triangle];
  return {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
}

/// The closest exact hit; of several at the same t the lowest geometry, then the lowest primitive (ray.h).
struct ExactClosest {
  bool found = false;
  std::uint32_t geometry = kInvalidId;
  std::uint32_t primitive = kInvalidId;
  FilteredHit where{};
};

namespace detail {

/// Whether a hit is nearer than the best one so far. Later triangles win only if they are strictly nearer.
inline bool nearer(const Ray& ray, const FilteredHit& hit, const Corners& at, const FilteredHit& best,
                   const Corners& best_at) {
  if (hit.t + hit.t_error < best.t - best.t_error) return true;
  if (hit.t - hit.t_error > best.t + best.t_error) return false;
  return compare_t(ray, at, best_at) < 0;
}

}  // namespace detail

/// Triangles that are not finite, and geometries that the ray's mask hides, are skipped.
inline ExactClosest closest(std::span<const Mesh> meshes, const Ray& ray) {
  ExactClosest best;
  if (!is_valid(ray)) return best;
  Corners best_at{};
  for (std::uint32_t geometry = 0; geometry < meshes.size(); ++geometry) {
    const Mesh& mesh = meshes[geometry];
    if ((mesh.mask & ray.mask) == 0) continue;
    for (std::uint32_t primitive = 0; primitive < mesh.triangles.size(); ++primitive) {
      const Corners at = corners(mesh, primitive);
      if (!is_finite(at)) continue;
      const FilteredHit hit = decide(ray, at);
      if (!hit.hit || (best.found && !detail::nearer(ray, hit, at, best.where, best_at))) continue;
      best = {true, geometry, primitive, hit};
      best_at = at;
    }
  }
  return best;
}

}  // namespace hiprt::oracle
