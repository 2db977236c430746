#pragma once
/// Scenes of triangles and custom primitives, and what is near a point by trying all.

#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <tests/traversal/customs/custom_shapes.h>
#include <tests/traversal/instances/moving_scenes.h>
#include <tests/traversal/points/point_queries.h>

namespace hiprt::checks {

/// A point that moves along the diagonal of its box from time 0 to 1. It finds the box by the full id.
struct Movers {
  std::span<const std::span<const Box>> boxes_of_geometry;

  CustomPoint closest(const PointInObject& at, PrimitiveId id) const {
    const Box& box = boxes_of_geometry[id.geometry][id.primitive];
    const double share = std::clamp(double{at.time}, 0.0, 1.0);
    CustomPoint result;
    double squared = 0;
    for (int k = 0; k < 3; ++k) {
      result.point[k] = (1 - share) * double{box.min[k]} + share * double{box.max[k]};
      squared += (result.point[k] - at.point[k]) * (result.point[k] - at.point[k]);
    }
    result.squared = squared;
    result.u = share;
    return squared <= at.limit_squared ? result : CustomPoint{};
  }
};
using NearShapes = PrimitiveList<SphereSet, RoundCurveSet, Movers>;

/// Triangles, spheres that come twice, strands of curves, and moving points.
struct NearWorld {
  std::vector<Sphere> spheres;
  std::vector<CurveVertex> vertices;
  std::vector<std::uint32_t> first_vertex;
  CustomWorld world;

  explicit NearWorld(std::uint64_t seed, double size = 1.0, unsigned count = 40) {
    Random random(seed);
    for (unsigned i = 0; i < count; ++i) {
      const Position at = random.in_cube(size);
      const double radius = i == 0 ? 0.0 : random.log_uniform(1e-3, 0.4);
      spheres.insert(spheres.end(), 2, {{at[0], at[1], at[2]}, static_cast<float>(size * radius)});
    }
    std::vector<Box> balls, segments, diagonals;
    for (const Sphere& sphere : spheres) balls.push_back(SphereSet::bounds(sphere));
    for (unsigned strand = 0; strand < count / 2; ++strand) add_strand(random, size);
    for (const std::uint32_t first : first_vertex)
      segments.push_back(RoundCurveSet::bounds(vertices[first], vertices[first + 1]));
    for (unsigned i = 0; i < count; ++i) {
      const Position a = random.in_cube(size), b = random.in_cube(0.2 * size);
      Box box;
      for (std::size_t k = 0; k < 3; ++k) box.min[k] = a[k], box.max[k] = a[k] + std::abs(b[k]);
      diagonals.push_back(box);
    }
    world.meshes = {oracle::soup(count, 0.3 * size, seed), oracle::placed(icosphere(1), 0.7 * size)};
    world.meshes[1].mask = 2;
    world.add(std::move(balls), 0);
    world.add(std::move(segments), 1, 5);
    world.add(std::move(diagonals), 2, 6);
    world.add({Box{{-1, -1, -1}, {1, 1, 1}}}, 9);  // Of a type that has no functor.
  }

  NearShapes shapes() const {
    return {{spheres.data()}, {vertices.data(), first_vertex.data()}, {world.boxes_of_geometry}};
  }

  /// Calls visit(geometry, primitive, corners) or visit(geometry, primitive, CustomPoint) for what the mask shows.
  /// @param point, time as the object sees them.
  template <class Visit> void try_all(const Vec3D& point, float time, std::uint32_t mask, Visit&& visit) const {
    std::uint32_t geometry = 0;
    for (const Mesh& mesh : world.meshes) {
      for (std::uint32_t i = 0; (mesh.mask & mask) != 0 && i < mesh.triangles.size(); ++i)
        if (const Corners c = corners(mesh, i); !is_dropped(c)) visit(geometry, i, c);
      ++geometry;
    }
    const PointInObject at{point, std::numeric_limits<double>::infinity(), time};
    for (std::size_t c = 0; c < world.customs.size(); ++c, ++geometry)
      for (std::uint32_t i = 0; (world.customs[c].mask & mask) != 0 && i < world.boxes[c].size(); ++i)
        visit(geometry, i, shapes().closest(world.customs[c].type, at, PrimitiveId{geometry, i}));
  }

 private:
  void add_strand(Random& random, double size) {
    Position at = random.in_cube(size);
    const unsigned points = 2 + random.below(4);
    for (unsigned i = 0; i < points; ++i) {
      const double radius = random.below(5) == 0 ? 0 : size * random.log_uniform(1e-3, 0.1);
      if (i + 1 < points) first_vertex.push_back(static_cast<std::uint32_t>(vertices.size()));
      vertices.push_back({{at[0], at[1], at[2]}, static_cast<float>(radius)});
      const Position step = random.in_cube(0.3 * size);
      for (std::size_t k = 0; k < 3; ++k) at[k] += step[k];
    }
  }
};

/// A result from what try_all() visits. The library computes each distance: results are the same bits.
template <class Result, class Placed>
Result to_result(const Vec3D& query, const Placed& placed, std::uint32_t geometry, std::uint32_t primitive,
                 const Corners& c) {
  using Real = std::remove_reference_t<decltype(Result{}.u)>;
  const Vec3D corner[3] = {placed.to_scene(vec3d(c.p0)), placed.to_scene(vec3d(c.p1)), placed.to_scene(vec3d(c.p2))};
  const TrianglePoint near = closest_on_triangle(corner, query);
  Result result;
  static_cast<BasicClosestPoint<Real>&>(result) = {near.squared,
                                                   BasicVec3<Real>(near.point),
                                                   static_cast<Real>(near.u),
                                                   static_cast<Real>(near.v),
                                                   geometry,
                                                   primitive,
                                                   near.feature};
  return result;
}
template <class Result, class Placed>
Result to_result(const Vec3D& query, const Placed& placed, std::uint32_t geometry, std::uint32_t primitive,
                 const CustomPoint& near) {
  using Real = std::remove_reference_t<decltype(Result{}.u)>;
  const Vec3D at = placed.to_scene(near.point), from = query - at;
  const bool in_scene = !placed.is_placed() || near.squared == std::numeric_limits<double>::infinity();
  Result result;
  static_cast<BasicClosestPoint<Real>&>(result) = {
      in_scene ? near.squared : std::fma(from.x, from.x, std::fma(from.y, from.y, from.z * from.z)),
      BasicVec3<Real>(at),
      static_cast<Real>(near.u),
      static_cast<Real>(near.v),
      geometry,
      primitive,
      TriangleFeature::kFace};
  return result;
}

/// All within the query's distance, in order.
template <class Real>
std::vector<BasicClosestPoint<Real>> try_all(const NearWorld& world, const BasicPointQuery<Real>& query) {
  using Result = BasicClosestPoint<Real>;
  std::vector<Result> results;
  const double farthest = query.max_distance;
  const Vec3D point(query.point);
  world.try_all(point, query.time, query.mask, [&](std::uint32_t geometry, std::uint32_t primitive, const auto& it) {
    const Result one = to_result<Result>(point, PlacedVertices<0>{}, geometry, primitive, it);
    if (one.distance_squared < std::numeric_limits<double>::infinity() && one.distance_squared <= farthest * farthest)
      results.push_back(one);
  });
  std::sort(results.begin(), results.end(), [](const auto& a, const auto& b) { return precedes(a, b); });
  return results;
}

}  // namespace hiprt::checks
