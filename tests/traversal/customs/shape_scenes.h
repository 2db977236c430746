#pragma once
/// Scenes with spheres and curves, flat and in instances, and the hits of a ray by a loop over all shapes.

#include <hiprt_build/format/view.h>
#include <hiprt_build/shapes.h>
#include <hiprt_device/primitives/scene_shapes.h>
#include <tests/traversal/instances/moving_scenes.h>

#include <algorithm>
#include <string>
#include <vector>

namespace hiprt::checks {

/// Shapes of one object: a mesh, spheres, curves.
struct ShapeObject {
  oracle::Mesh mesh;
  std::vector<ShapePoint> balls, axes;
  std::vector<std::uint32_t> segments;

  explicit ShapeObject(std::uint64_t seed, unsigned count) : mesh(oracle::soup(4, 1, seed)) {
    oracle::Random random(seed);
    const auto point = [&](const oracle::Position& at, double radius) {
      return ShapePoint{{at[0], at[1], at[2]}, static_cast<float>(radius)};
    };
    // One random number per statement: compilers evaluate arguments in different orders.
    for (unsigned i = 0; i < count; ++i) {
      const double radius = random.log_uniform(0.01, 0.3);
      balls.push_back(point(random.in_cube(1), radius));
    }
    balls.push_back(point(random.in_cube(1), 0));
    std::vector<std::uint32_t> points;
    for (unsigned strand = 0; strand < count; ++strand) {
      oracle::Position at = random.in_cube(1);
      points.push_back(2 + random.below(4));
      for (unsigned i = 0; i < points.back(); ++i) {
        axes.push_back(point(at, random.below(6) == 0 ? 0 : random.log_uniform(0.003, 0.1)));
        const oracle::Position step = random.in_cube(0.4);
        for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += step[axis];
      }
    }
    segments = build::strand_segments(points);
  }

  build::Shapes spheres() const { return {ShapeKind::kSpheres, balls, {}}; }
  build::Shapes curves() const { return {ShapeKind::kCurves, axes, segments}; }

  build::Buffer build(NodeLayout layout, build::Builder builder) const {
    const auto sphere_boxes = build::shape_boxes(spheres()), curve_boxes = build::shape_boxes(curves());
    REQUIRE((sphere_boxes.has_value() && curve_boxes.has_value()));
    const std::vector<oracle::Mesh> meshes{mesh};
    const auto views = oracle::views(meshes);
    const build::CustomGeometry customs[] = {{.boxes = *curve_boxes, .type = 200, .shapes = curves()},
                                             {.boxes = *sphere_boxes, .shapes = spheres()}};
    auto bvh = build::build(build::SceneInput{views, customs}, {.builder = builder, .nodes = layout});
    INFO((bvh ? std::string() : bvh.error().message));
    REQUIRE(bvh.has_value());
    const auto valid = validate(bvh->buffer.bytes());
    INFO((valid ? std::string() : to_string(valid.error())));
    REQUIRE(valid.has_value());
    return std::move(bvh->buffer);
  }

  /// The closest shape that a ray hits, by a loop over all shapes. Geometry 0 is the mesh, which others test.
  void search(const Ray& ray, Hit& best) const {
    const auto take = [&](std::uint32_t geometry, std::uint32_t i) {
      return [&best, geometry, i](const CustomHit& hit) {
        if (hit.t < best.t) best = {hit.t, hit.u, hit.v, geometry, i, hit.normal, hit.error};
        return true;
      };
    };
    for (std::uint32_t i = 0; i < segments.size(); ++i)
      RoundCurveSet{axes.data(), segments.data()}.intersect(ray, std::max(ray.tmin, 0.0f), std::min(best.t, ray.tmax),
                                                            i, take(1, i));
    for (std::uint32_t i = 0; i < balls.size(); ++i)
      SphereSet{reinterpret_cast<const Sphere*>(balls.data())}.intersect(ray, std::max(ray.tmin, 0.0f),
                                                                         std::min(best.t, ray.tmax), i, take(2, i));
  }
};

/// Objects 0 and 1 hold shapes. Groups have instances of them; some instances move.
struct ShapeScene : InstanceScene {
  std::vector<ShapeObject> objects;
  std::vector<build::Buffer> meshes;  ///< Of all objects.
  build::Motion motion{.keys = {{.time = 0}, {.time = 1, .translation = {1, 2, 0}, .rotation = {1, 0, 0, 1}}}};

  ShapeScene(unsigned levels, std::uint64_t seed) {
    oracle::Random random(seed + 7);
    for (unsigned i = 0; i < 2; ++i) {
      objects.emplace_back(seed + i, 4 + 3 * i);
      files.push_back(objects.back().build(NodeLayout::kPlanes, build::Builder::kHploc));
    }
    const oracle::Mesh mesh_only = oracle::soup(3, 1, seed);
    add_file({mesh_only}, NodeLayout::kPlanes);
    for (const oracle::Mesh& mesh : {objects[0].mesh, objects[1].mesh, mesh_only})
      meshes.push_back(std::move(build::build(oracle::views({mesh}))->buffer));
    for (unsigned level = 0; level < levels; ++level) {
      groups.emplace_back(8);
      for (Instance& instance : groups.back()) {
        instance = {.object = random.below(static_cast<std::uint32_t>(3 + level)),
                    .to_scene = random_affine(random, 3)};
        if (random.below(3) == 0) instance.motion = &motion;
      }
      groups.back()[0].object = level == 0 ? 0 : 2 + level;
    }
    InstanceScene::build();
  }

  /// The closest hit of all instance paths. Only t, geometry and primitive matter.
  Hit closest_of_all(const SceneView& view, const Ray& ray) const {
    Hit best;
    for_each_path(view, ray, [&](std::uint32_t object, const Ray& local) {
      const Hit hit = closest_hit(make_scene_view(*open_buffer(meshes[object].bytes())), local);
      if (hit.t < best.t) best = hit;
      if (object < 2) objects[object].search(local, best);
    });
    return best;
  }
};

}  // namespace hiprt::checks
