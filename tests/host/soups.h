#pragma once
/// Soups of triangles, and rays through them, by seed.

#include <hiprt_device/ray.h>
#include <tests/oracle/mesh.h>
#include <tests/oracle/random.h>

namespace hiprt::checks {

using oracle::Mesh;
using oracle::Position;
using oracle::Random;

/// Triangles at random places; every third one is there twice.
inline Mesh soup(Random& random, unsigned count, double size) {
  Mesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const Position center = random.in_cube(1.0);
    Position corner[3];
    for (Position& p : corner) {
      const Position offset = random.in_cube(size);
      p = {center[0] + offset[0], center[1] + offset[1], center[2] + offset[2]};
    }
    append(mesh, corner[0], corner[1], corner[2]);
    if (i % 3 == 0) append(mesh, corner[0], corner[1], corner[2]);
  }
  return mesh;
}

/// From anywhere near the scene, also along axes and with ends.
inline Ray random_ray(Random& random, double scale) {
  Ray ray;
  const Position from = random.in_cube(1.5 * scale), to = random.in_cube(scale);
  const unsigned axis = random.below(8);
  for (int k = 0; k < 3; ++k) {
    ray.origin[k] = from[static_cast<std::size_t>(k)];
    ray.direction[k] = to[static_cast<std::size_t>(k)] - from[static_cast<std::size_t>(k)];
    if (axis < 3 && static_cast<unsigned>(k) != axis) ray.direction[k] = 0.0f;
  }
  if (random.coin()) ray.tmax = random.below(20) == 0 ? -0.0f : random.uniform_float(0.0, 1.5);
  if (random.below(4) == 0) ray.tmin = random.uniform_float(-0.5, 0.8);
  return ray;
}

}  // namespace hiprt::checks
