#pragma once
/// The meshes of the tests that compare a GPU's hits with the host's, and rays that are hard on them.

#include <hiprt_device/ray.h>
#include <tests/oracle/meshes.h>

namespace hiprt::checks {

/// Two geometries with different masks: a closed, jagged star, and triangles of all sizes around it.
inline std::vector<oracle::Mesh> random_meshes(std::uint64_t seed) {
  oracle::Random random(seed);
  oracle::Mesh soup;
  for (int i = 0; i < 2000; ++i) {
    const oracle::Position center = random.in_cube(2.0);
    const double size = random.log_uniform(1e-4, 1.0);
    std::array<oracle::Position, 3> corner{};
    for (oracle::Position& p : corner) {
      p = random.in_cube(size);
      for (std::size_t k = 0; k < 3; ++k) p[k] += center[k];
    }
    oracle::append(soup, corner[0], corner[1], corner[2]);
  }
  std::vector<oracle::Mesh> meshes{oracle::star(4, seed), std::move(soup)};
  meshes[0].mask = 1;
  meshes[1].mask = 2;
  return meshes;
}

/// From anywhere at a vertex, the middle of an edge or the inside of a triangle; along an axis; or anyhow. Lengths,
/// ranges and masks vary.
inline Ray random_ray(const std::vector<oracle::Mesh>& meshes, oracle::Random& random) {
  const oracle::Mesh& mesh = meshes[random.below(static_cast<std::uint32_t>(meshes.size()))];
  const oracle::Triangle& triangle = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
  const oracle::Position &a = mesh.positions[triangle[0]], &b = mesh.positions[triangle[1]],
                         &c = mesh.positions[triangle[2]];
  const unsigned kind = random.below(6);
  const double s = kind == 0 ? 0.0 : kind == 1 ? 0.5 : random.unit(), r = kind < 2 ? 0.0 : (1 - s) * random.unit();
  const double length = random.log_uniform(0.01, 100.0);
  const oracle::Position from = random.in_cube(3.0);
  Ray ray;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double target = a[i] + s * (double{b[i]} - a[i]) + r * (double{c[i]} - a[i]);
    ray.origin[k] = from[i];
    ray.direction[k] = static_cast<float>((target - from[i]) * length);
    if (kind == 4) ray.direction[k] = 0.0f;
    if (kind == 5) ray.direction[k] = random.uniform_float(-1.0, 1.0);
  }
  if (kind == 4) ray.direction[static_cast<int>(random.below(3))] = random.coin() ? 1.0f : -0.0f;
  if (random.below(8) == 0) ray.tmin = random.uniform_float(-0.5, 0.5);
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0.0, 2.0);
  ray.mask = random.below(4) == 0 ? 1 + random.below(2) : 3;
  return ray;
}

}  // namespace hiprt::checks
