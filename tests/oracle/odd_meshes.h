#pragma once
/// Difficult meshes: soups, needles, duplicates, triangles without area, NaN, infinities, extreme sizes.

#include <tests/oracle/mesh.h>
#include <tests/oracle/random.h>

#include <limits>

namespace hiprt::oracle {

/// @pre there are so many.
inline Mesh first_triangles(Mesh mesh, std::size_t count) {
  mesh.triangles.resize(count);
  if (count == 0) mesh.positions.clear();
  return mesh;
}

/// @p count unconnected triangles in the cube [-1, 1]^3 with edges of about @p size.
inline Mesh soup(unsigned count, double size, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const Position p = random.in_cube(1.0), a = random.in_cube(size), b = random.in_cube(size);
    append(mesh, p, {p[0] + a[0], p[1] + a[1], p[2] + a[2]}, {p[0] + b[0], p[1] + b[1], p[2] + b[2]});
  }
  return mesh;
}

/// @p count unconnected triangles of length about 1 and width 1 / aspect in all directions.
inline Mesh needles(unsigned count, double aspect, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const Position p = random.in_cube(1.0);
    const Double3 along = random.on_sphere(), aside = random.on_sphere();
    const double length = random.uniform(0.5, 1.5), shift = random.unit();
    const auto point = [&](double a, double b) {
      return rounded(
          {p[0] + a * along[0] + b * aside[0], p[1] + a * along[1] + b * aside[1], p[2] + a * along[2] + b * aside[2]});
    };
    append(mesh, p, point(length, 0), point(length * shift, length / aspect));
  }
  return mesh;
}

/// Slivers: triangles whose third corner lies within @p height of the line through the other two.
inline Mesh slivers(unsigned count, double height, std::uint64_t seed) { return needles(count, 1.0 / height, seed); }

namespace odd_detail {

/// One triangle twice, one with corners that coincide or lie on a line, or one that is not finite. @param kind 0 to 6.
inline void append_broken(Mesh& mesh, unsigned kind, const Position& p, const Position& q, const Position& r) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  switch (kind) {
    case 0:
      append(mesh, p, q, r), append(mesh, p, q, r);
      break;
    case 1:
      append(mesh, p, p, q);
      break;
    case 2:
      append(mesh, p, p, p);
      break;
    case 3:
      append(mesh, {0, 0, p[2]}, {1, 1, p[2]}, {2, 2, p[2]});
      break;
    case 4:
      append(mesh, p, q, {kNan, r[1], r[2]});
      break;
    case 5:
      append(mesh, p, {q[0], kInfinity, q[2]}, r);
      break;
    default:
      append(mesh, {-kInfinity, p[1], p[2]}, q, r);
      break;
  }
}

/// A tiny or huge triangle, or one of random bits, or an ordinary one. @param kind 7 or more.
inline void append_sized(Mesh& mesh, unsigned kind, Random& random) {
  const auto any = [&] { return Position{random.any_float(), random.any_float(), random.any_float()}; };
  if (kind == 10) return append(mesh, any(), any(), any());
  const double size = kind == 7 ? 1e-42 : kind == 8 ? 1e18 : kind == 9 ? 1e-30 : 1.0;
  append(mesh, random.in_cube(size), random.in_cube(size), random.in_cube(size));
}

}  // namespace odd_detail

/// A soup with much that is wrong: duplicates, repeated corners, collinear corners, NaN, infinities, denormals,
/// coordinates of 1e18 and of 1e-30, and random bits.
inline Mesh torture(unsigned count, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const Position p = random.in_cube(1.0), q = random.in_cube(1.0), r = random.in_cube(1.0);
    const unsigned kind = random.below(12);
    if (kind < 7)
      odd_detail::append_broken(mesh, kind, p, q, r);
    else
      odd_detail::append_sized(mesh, kind, random);
  }
  return mesh;
}

/// @p count triangles as long as the cube [-1, 1]^3, nearly parallel to the x axis, that cross each other.
inline Mesh cables(unsigned count, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const Position p = random.in_cube(1.0);
    append(mesh, {-1, p[0], p[1]}, {1, p[2], p[1] + 0.001f}, {1, p[2] + 0.001f, p[1]});
  }
  return mesh;
}

/// A disc of @p count slim triangles around the origin.
inline Mesh fan(unsigned count) {
  Mesh mesh;
  mesh.positions.push_back({0, 0, 0});
  for (unsigned i = 0; i < count; ++i) {
    const double angle = 6.283185307179586 * i / count;
    mesh.positions.push_back(rounded({std::cos(angle), std::sin(angle), 0}));
    mesh.triangles.push_back({0, i + 1, i + 1 == count ? 1 : i + 2});
  }
  return mesh;
}

/// @p count copies of one triangle.
inline Mesh identical(unsigned count) {
  Mesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  mesh.triangles.assign(count, {0, 1, 2});
  return mesh;
}

/// @p count different triangles whose boxes all have the origin as their centre.
inline Mesh concentric(unsigned count, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const float x = random.uniform_float(0.1, 1), y = random.uniform_float(0.1, 1), z = random.uniform_float(0.1, 1);
    append(mesh, {-x, -y, -z}, {x, y, z}, {x, -y, random.uniform_float(-z, z)});
  }
  return mesh;
}

/// @p count triangles whose boxes are nested cubes with a corner at the origin. The largest has edge 1, and there are
/// 16 cubes per power of two. Each cube is the nearest one to all cubes inside it, so joining nearest neighbours makes
/// a chain. (With fewer cubes per power of two, the cells of Morton codes fill too soon. With more, equal halves join
/// first.)
inline Mesh nested(unsigned count, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (unsigned i = 1; i <= count; ++i) {
    const float s = std::exp2((static_cast<float>(i) - static_cast<float>(count)) / 16);
    append(mesh, {0, 0, s * random.uniform_float(0, 1)}, {s, s * random.uniform_float(0, 1), 0},
           {s * random.uniform_float(0, 1), s, s});
  }
  return mesh;
}

}  // namespace hiprt::oracle
