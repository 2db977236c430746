#pragma once
/// Generators of closed meshes with a known inside, and of planes, by seed. odd_meshes.h has difficult meshes.

#include <tests/oracle/mesh.h>
#include <tests/oracle/random.h>

#include <numbers>
#include <set>

namespace hiprt::oracle {

namespace detail {

/// The icosahedron with faces split into four @p levels times, vertices on the unit sphere in double.
struct Sphere {
  std::vector<Double3> points;
  std::vector<Triangle> triangles;
};

inline Double3 normalized(const Double3& p) {
  const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  return {p[0] / length, p[1] / length, p[2] / length};
}

inline Sphere icosahedron() {
  const double g = std::numbers::phi;
  Sphere s;
  for (const Double3& p : {Double3{-1, g, 0},
                           {1, g, 0},
                           {-1, -g, 0},
                           {1, -g, 0},
                           {0, -1, g},
                           {0, 1, g},
                           {0, -1, -g},
                           {0, 1, -g},
                           {g, 0, -1},
                           {g, 0, 1},
                           {-g, 0, -1},
                           {-g, 0, 1}})
    s.points.push_back(normalized(p));
  s.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return s;
}

inline Sphere unit_sphere(unsigned levels) {
  Sphere s = icosahedron();
  for (unsigned level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(s.points.size()));
      if (fresh) {
        const Double3 p = s.points[a], q = s.points[b];
        s.points.push_back(normalized({p[0] + q[0], p[1] + q[1], p[2] + q[2]}));
      }
      return entry->second;
    };
    std::vector<Triangle> finer;
    for (const Triangle& t : s.triangles) {
      const std::uint32_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}});
    }
    s.triangles = std::move(finer);
  }
  return s;
}

}  // namespace detail

/// Unit sphere around the origin, 20 * 4^levels triangles.
inline Mesh icosphere(unsigned levels) {
  const detail::Sphere s = detail::unit_sphere(levels);
  Mesh mesh;
  for (const Double3& p : s.points) mesh.positions.push_back(rounded(p));
  mesh.triangles = s.triangles;
  return mesh;
}

/// Closed, star-shaped around the origin: sphere vertices at random distances in [0.3, 1]. Its faces hold the ball of
/// radius 0.1 for levels >= 2 or so; neighbours differ widely in size and angle.
inline Mesh star(unsigned levels, std::uint64_t seed) {
  Random random(seed);
  const detail::Sphere s = detail::unit_sphere(levels);
  Mesh mesh;
  for (const Double3& p : s.points) {
    const double r = random.log_uniform(0.3, 1.0);
    mesh.positions.push_back(rounded({p[0] * r, p[1] * r, p[2] * r}));
  }
  mesh.triangles = s.triangles;
  return mesh;
}

/// The same surface with T-junctions: about half of the triangles are split into four at the middles of their edges. A
/// neighbour that is not split keeps the long edge, and a triangle without area between the two closes the mesh.
/// Corners are first rounded to multiples of 2^-10, so that the middles lie on the edges exactly.
/// @pre coordinates up to 1 in magnitude.
inline Mesh with_t_junctions(Mesh mesh, std::uint64_t seed) {
  Random random(seed);
  for (Position& p : mesh.positions)
    for (float& x : p) x = std::round(x * 0x1p10f) * 0x1p-10f;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  std::set<std::pair<std::uint32_t, std::uint32_t>> whole;  // Directed edges of triangles that are not split.
  std::vector<Triangle> triangles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [entry, fresh] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
    if (fresh) {
      const Position p = mesh.positions[a], q = mesh.positions[b];
      mesh.positions.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return entry->second;
  };
  for (const Triangle& t : mesh.triangles) {
    if (random.coin()) {
      triangles.push_back(t);
      for (std::size_t i = 0; i < 3; ++i) whole.insert({t[i], t[(i + 1) % 3]});
      continue;
    }
    const std::uint32_t a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
    triangles.insert(triangles.end(), {{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}});
  }
  for (const auto& [edge, m] : middles)
    for (const auto& [p, q] : {edge, std::pair(edge.second, edge.first)})
      if (whole.count({p, q}) != 0) triangles.push_back({q, p, m});
  mesh.triangles = std::move(triangles);
  return mesh;
}

/// Ring of radius 1 in the xy plane with a tube of radius @p tube, around x n quads each cut in two.
inline Mesh torus(unsigned around, unsigned across, double tube) {
  Mesh mesh;
  for (unsigned i = 0; i < around; ++i)
    for (unsigned j = 0; j < across; ++j) {
      const double a = 2 * std::numbers::pi * i / around, b = 2 * std::numbers::pi * j / across;
      const double r = 1.0 + tube * std::cos(b);
      mesh.positions.push_back(rounded({r * std::cos(a), r * std::sin(a), tube * std::sin(b)}));
    }
  const auto at = [&](unsigned i, unsigned j) { return (i % around) * across + j % across; };
  for (unsigned i = 0; i < around; ++i)
    for (unsigned j = 0; j < across; ++j) {
      const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
      mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
    }
  return mesh;
}

namespace detail {

/// Increasing numbers from -1 to 1 whose steps grow geometrically from one end, from both, or are random.
inline std::vector<double> uneven_steps(unsigned count, double growth, Random& random) {
  std::vector<double> steps;
  double sum = 0.0;
  for (unsigned i = 0; i < count; ++i) {
    steps.push_back(std::pow(growth, i) * random.uniform(0.5, 1.0));
    sum += steps.back();
  }
  std::vector<double> result{-1.0};
  double at = 0.0;
  for (unsigned i = 0; i + 1 < count; ++i) result.push_back(-1.0 + 2.0 * (at += steps[i]) / sum);
  result.push_back(1.0);
  return result;
}

}  // namespace detail

/// The cube [-1, 1]^3, each face cut by the same uneven lines into count^2 rectangles of two triangles; vertices are
/// shared also across the cube's edges. @param growth ratio of neighbouring steps: growth^count between the extremes.
inline Mesh subdivided_box(unsigned count, double growth, std::uint64_t seed) {
  Random random(seed);
  const std::array lines{detail::uneven_steps(count, growth, random), detail::uneven_steps(count, growth, random),
                         detail::uneven_steps(count, growth, random)};
  Mesh mesh;
  std::map<std::array<unsigned, 3>, std::uint32_t> vertices;
  const auto vertex = [&](const std::array<unsigned, 3>& at) {
    const auto [entry, fresh] = vertices.try_emplace(at, static_cast<std::uint32_t>(mesh.positions.size()));
    if (fresh) mesh.positions.push_back(rounded({lines[0][at[0]], lines[1][at[1]], lines[2][at[2]]}));
    return entry->second;
  };
  for (unsigned face = 0; face < 6; ++face) {
    const unsigned w = face / 2, u = (w + 1) % 3, v = (w + 2) % 3;
    const auto corner = [&](unsigned i, unsigned j) {
      std::array<unsigned, 3> at{};
      at[w] = face % 2 == 0 ? 0 : count;
      at[u] = i, at[v] = j;
      return vertex(at);
    };
    for (unsigned i = 0; i < count; ++i)
      for (unsigned j = 0; j < count; ++j) {
        std::uint32_t a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1), d = corner(i, j + 1);
        if (face % 2 == 0) std::swap(b, d);
        if (random.coin())
          mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
        else
          mesh.triangles.insert(mesh.triangles.end(), {{a, b, d}, {b, c, d}});
      }
  }
  return mesh;
}

/// A closed needle: a tube of radius 1 / aspect around the z axis from -1 to 1 with pointed ends, made of @p sides
/// strips of
/// @p rings rings. Its side triangles are about 2 * aspect / (rings * pi / sides) times longer than wide.
inline Mesh spindle(unsigned sides, unsigned rings, double aspect) {
  Mesh mesh;
  mesh.positions = {{0, 0, -1}, {0, 0, 1}};
  for (unsigned ring = 0; ring < rings; ++ring)
    for (unsigned side = 0; side < sides; ++side) {
      const double z = -1.0 + 2.0 * (ring + 1) / (rings + 1), angle = 2 * std::numbers::pi * side / sides;
      mesh.positions.push_back(rounded({std::cos(angle) / aspect, std::sin(angle) / aspect, z}));
    }
  const auto at = [&](unsigned ring, unsigned side) { return 2 + ring * sides + side % sides; };
  for (unsigned side = 0; side < sides; ++side) {
    mesh.triangles.push_back({0, at(0, side + 1), at(0, side)});
    mesh.triangles.push_back({1, at(rings - 1, side), at(rings - 1, side + 1)});
    for (unsigned ring = 0; ring + 1 < rings; ++ring) {
      const std::uint32_t a = at(ring, side), b = at(ring, side + 1), c = at(ring + 1, side + 1),
                          d = at(ring + 1, side);
      mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
    }
  }
  return mesh;
}

/// The square [-1, 1]^2 in the plane axis = height, cut into count^2 equal squares of two triangles.
inline Mesh grid_plane(unsigned count, unsigned axis, float height) {
  Mesh mesh;
  for (unsigned i = 0; i <= count; ++i)
    for (unsigned j = 0; j <= count; ++j) {
      Position p{};
      p[axis] = height;
      p[(axis + 1) % 3] = static_cast<float>(-1.0 + 2.0 * i / count);
      p[(axis + 2) % 3] = static_cast<float>(-1.0 + 2.0 * j / count);
      mesh.positions.push_back(p);
    }
  for (unsigned i = 0; i < count; ++i)
    for (unsigned j = 0; j < count; ++j) {
      const std::uint32_t a = i * (count + 1) + j, b = a + count + 1, c = b + 1, d = a + 1;
      mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
    }
  return mesh;
}

/// Every triangle with separate vertices, in random order: welding and pairing must find the shared edges.
inline Mesh scattered(const Mesh& mesh, std::uint64_t seed) {
  Random random(seed);
  Mesh result;
  std::vector<Triangle> order = mesh.triangles;
  for (std::uint32_t i = static_cast<std::uint32_t>(order.size()) - 1; i > 0; --i)
    std::swap(order[i], order[random.below(i + 1)]);
  for (const Triangle& triangle : order) {
    const auto first = static_cast<std::uint32_t>(result.positions.size());
    for (const std::uint32_t index : triangle) result.positions.push_back(mesh.positions[index]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

}  // namespace hiprt::oracle
