#pragma once
/// The teapot in the stadium: a hall and, in one spot, an object of triangles too small for short Morton codes.

#include <tests/oracle/meshes.h>

#include <utility>

namespace hiprt::oracle {

/// Half the edge of the object's box, whose middle is the origin, in metres.
inline constexpr double kOperaObjectHalf = 0.01;

/// @param triangles about so many, at least 100: an eighth is the hall's walls, the others are grains of the object.
/// @param ratio of the edges of hall and object, at least 4. With more than 1024 the object lies within a cell or two
///   of a grid of 10 bits per axis.
/// @return triangles in random order, like the order in files of merged parts. The result depends on the arguments and
///   on the compiler, which may change the last bits of coordinates.
inline Mesh opera_house(unsigned triangles, double ratio) {
  Random random(1903);
  const unsigned cells = std::max(1u, static_cast<unsigned>(std::sqrt(triangles / 96.0)));
  const double hall = kOperaObjectHalf * ratio;
  // Off the middle, so that the object is not on the border of the halves.
  Mesh mesh = placed(subdivided_box(cells, 1.0, random.bits()), 0.9 * hall, {0.1 * hall, 0.07 * hall, 0.13 * hall});
  constexpr unsigned kGrainTriangles = 320;
  const double radius = 0.1 * kOperaObjectHalf;
  for (unsigned grain = 0; grain < std::max(1u, triangles / 8 * 7 / kGrainTriangles); ++grain) {
    const Position at = random.in_cube(kOperaObjectHalf - radius);
    append(mesh, placed(icosphere(2), radius * random.uniform(0.2, 1.0), {at[0], at[1], at[2]}));
  }
  for (auto i = static_cast<std::uint32_t>(mesh.triangles.size()) - 1; i > 0; --i)
    std::swap(mesh.triangles[i], mesh.triangles[random.below(i + 1)]);
  return mesh;
}

/// The object's box.
inline Box opera_object_box() {
  const auto half = static_cast<float>(kOperaObjectHalf);
  return Box{{-half, -half, -half}, {half, half, half}};
}

}  // namespace hiprt::oracle
