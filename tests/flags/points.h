#pragma once
/// Closest points of a lattice mesh have the same bits under all settings, and no triangle is nearer.

#include <tests/flags/check.h>
#include <tests/flags/lattice.h>

namespace hiprt::flags {

/// @param mesh that of the scene, which has one instance of it if P has levels.
template <class P> unsigned closest_points(const std::string& name, const SceneView& scene, const Mesh& mesh) {
  using Real = typename P::Real;
  constexpr unsigned kPoints = 1500;
  Check check(name + ": closest points", kSeed + 21);
  Random random(kSeed + 21);
  for (unsigned i = 0; i < kPoints; ++i) {
    const Vec3 on = lattice_point(random, i % 3 == 0 ? 40960 : 4096);
    const Vec3 at = on * power(random, 3);
    check.on_ray(BasicRay<Real>{.origin = BasicVec3<Real>(at)});
    typename P::Stack::Memory memory;
    const auto near =
        closest_point<P>(scene, BasicPointQuery<Real>{BasicVec3<Real>(at)}, typename P::Stack::Storage(memory));
    check.put_out(near.distance_squared);
    check.put_out(static_cast<std::uint32_t>(near.feature));
    check.on_hit(BasicHit<Real>{near.distance(), near.u, near.v, near.geometry, near.primitive, near.point});
    if constexpr (P::kLevels != 0) continue;
    for (const build::Triangle& triangle : mesh.triangles) {
      Vec3D corner[3];
      for (unsigned k = 0; k < 3; ++k) corner[k] = Vec3D(vec3(mesh.positions[triangle[k]]));
      const double other = closest_on_triangle(corner, Vec3D(at)).squared;
      check.expect(near.distance_squared <= other, "a triangle is nearer: %a, found %a", other, near.distance_squared);
    }
  }
  return check.finish(kPoints);
}

}  // namespace hiprt::flags
