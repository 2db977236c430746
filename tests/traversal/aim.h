#pragma once
/// Rays from inside closed meshes at their edges and vertices, where careless rounding leaks.

#include <tests/oracle/meshes.h>
#include <tests/oracle/ray_triangle.h>

#include <string>

namespace hiprt::checks {

using namespace hiprt::oracle;

/// A closed mesh around known inner points.
struct Closed {
  std::string name;
  Mesh mesh;
  std::vector<Double3> centers;  ///< Points inside.
  double inner_radius = 0.0;     ///< A ball of this radius around each center is inside.
  double scale = 1.0;            ///< The mesh's radius, about.
};

/// The closed meshes of the tests, of radius about 1.
inline std::vector<Closed> closed_meshes() {
  const Double3 origin{0, 0, 0};
  std::vector<Double3> ring;
  for (int i = 0; i < 5; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.3) / 5;
    ring.push_back({std::cos(angle), std::sin(angle), 0});
  }
  return {{"icosphere", icosphere(4), {origin}, 0.5, 1},
          {"torus", torus(60, 30, 0.4), ring, 0.2, 1},
          {"star", star(4, 11), {origin}, 0.05, 1},
          {"T-junctions", with_t_junctions(icosphere(3), 13), {origin}, 0.5, 1},
          {"box", subdivided_box(12, 1.9, 12), {origin}, 0.9, 1},
          {"spindle", spindle(8, 40, 1e3), {origin}, 1e-4, 1}};
}

/// @return the same surface scaled and moved, vertices rounded to float.
inline Closed placed(const Closed& closed, double scale, const Double3& offset) {
  Closed result = closed;
  result.mesh = oracle::placed(closed.mesh, scale, offset);
  result.inner_radius *= scale;
  result.scale *= scale;
  for (Double3& c : result.centers)
    for (std::size_t k = 0; k < 3; ++k) c[k] = c[k] * scale + offset[k];
  return result;
}

/// A point of the surface: mostly on an edge, often a vertex, sometimes inside a triangle.
inline Double3 target_point(const Mesh& mesh, Random& random) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  const Triangle& triangle = mesh.triangles[random.below(count)];
  const unsigned first = random.below(3);
  const Position &a = mesh.positions[triangle[first]], &b = mesh.positions[triangle[(first + 1) % 3]],
                 &c = mesh.positions[triangle[(first + 2) % 3]];
  const unsigned kind = random.below(8);
  const double s = kind < 3 ? 0.0 : kind == 3 ? 0.5 : random.unit(), r = kind == 7 ? random.unit() * (1 - s) : 0.0;
  Double3 p{};
  for (std::size_t k = 0; k < 3; ++k) p[k] = a[k] + s * (double{b[k]} - a[k]) + r * (double{c[k]} - a[k]);
  return p;
}

/// A ray from inside at target_point(); directions of many lengths, some of them exactly through a vertex.
/// @param stretch directions are the vector to the target times a number in [1 / stretch, stretch].
inline Ray aimed_ray(const Closed& closed, Random& random, double stretch) {
  const auto center_count = static_cast<std::uint32_t>(closed.centers.size());
  Double3 from = closed.centers[random.below(center_count)];
  if (random.below(4) != 0) {
    const Double3 away = random.on_sphere();
    const double length = closed.inner_radius * random.unit();
    for (std::size_t k = 0; k < 3; ++k) from[k] += length * away[k];
  }
  Ray ray;
  ray.origin = vec3(rounded(from));
  const Double3 to = target_point(closed.mesh, random);
  const double factor = random.coin() ? 1.0 : random.log_uniform(1 / stretch, stretch);
  for (int k = 0; k < 3; ++k)
    ray.direction[k] = static_cast<float>((to[static_cast<std::size_t>(k)] - double{ray.origin[k]}) * factor);
  if (random.below(4) == 0) {  // One unit in the last place aside.
    const int k = static_cast<int>(random.below(3));
    const float toward =
        random.coin() ? std::numeric_limits<float>::infinity() : -std::numeric_limits<float>::infinity();
    ray.direction[k] = std::nextafter(ray.direction[k], toward);
  }
  return ray;
}

}  // namespace hiprt::checks
