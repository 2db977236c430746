#pragma once
/// Scenes with materials for the tests of the path tracer.

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/shapes.h>
#include <tests/oracle/meshes.h>
#include <tools/render/image/image.h>
#include <tools/render/path/path_trace.h>

#include <tests/catch.h>

#include <string>
#include <utility>
#include <vector>

namespace hiprt::test {

/// A square of side 2 in the plane y = 0, seen from above and below; texture coordinates from 0 to 1 along x and z.
inline oracle::Mesh floor_square(float half = 1.0f) {
  oracle::Mesh mesh;
  mesh.positions = {{-half, 0, -half}, {half, 0, -half}, {half, 0, half}, {-half, 0, half}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

/// Meshes with one material each.
struct PathTestScene {
  build::Buffer file;
  tools::SceneSurfaces surfaces;

  BufferView view() const { return *open_buffer(file.bytes()); }
};

inline tools::GeometrySurface surface_of(const oracle::Mesh& mesh, std::uint32_t material) {
  tools::GeometrySurface surface;
  surface.triangles = mesh.triangles;
  surface.materials.assign(mesh.triangles.size(), material);
  return surface;
}

/// Geometry i has material i.
inline PathTestScene flat_scene(const std::vector<oracle::Mesh>& meshes, std::vector<tools::Material> materials) {
  auto bvh = build::build(oracle::views(meshes));
  REQUIRE(bvh.has_value());
  PathTestScene scene{std::move(bvh->buffer), {{}, std::move(materials), {{}}}};
  for (std::uint32_t i = 0; i < meshes.size(); ++i) scene.surfaces.objects[0].push_back(surface_of(meshes[i], i));
  return scene;
}

/// Geometry i has material i: the meshes. Behind them are the shapes, with the surface @p last.
inline PathTestScene scene_with_shapes(const std::vector<oracle::Mesh>& meshes, const build::Shapes& shapes,
                                       tools::GeometrySurface last, std::vector<tools::Material> materials) {
  const auto boxes = build::shape_boxes(shapes);
  REQUIRE(boxes.has_value());
  const build::CustomGeometry custom{.boxes = *boxes, .shapes = shapes};
  const auto views = oracle::views(meshes);
  auto bvh = build::build(build::SceneInput{views, {&custom, 1}});
  REQUIRE(bvh.has_value());
  PathTestScene scene{std::move(bvh->buffer), {{}, std::move(materials), {{}}}};
  for (std::uint32_t i = 0; i < meshes.size(); ++i) scene.surfaces.objects[0].push_back(surface_of(meshes[i], i));
  scene.surfaces.objects[0].push_back(std::move(last));
  return scene;
}

/// Geometry i has material i: the meshes, and behind them the balls.
inline PathTestScene scene_with_balls(const std::vector<oracle::Mesh>& meshes, const std::vector<ShapePoint>& balls,
                                      std::vector<tools::Material> materials) {
  tools::GeometrySurface surface;
  surface.shapes = balls.size();
  surface.shape_material = static_cast<std::uint32_t>(meshes.size());
  return scene_with_shapes(meshes, {ShapeKind::kSpheres, balls, {}}, std::move(surface), std::move(materials));
}

/// Triangles that move: the mesh at each time. The vertices' normals are those of the times, if there are any.
struct KeyedMesh {
  std::vector<float> times;
  std::vector<oracle::Mesh> meshes;
  std::vector<std::array<float, 3>> normals{};
};

/// Geometry i has material i: the meshes, and behind them what moves.
inline PathTestScene scene_with_motion(const std::vector<oracle::Mesh>& meshes, const KeyedMesh& moving,
                                       std::vector<tools::Material> materials) {
  std::vector<ShapePoint> points;
  for (std::size_t k = 0; k < moving.times.size(); ++k)
    for (const auto& p : moving.meshes[k].positions) points.push_back({{p[0], p[1], p[2]}, moving.times[k]});
  std::vector<std::uint32_t> corners;
  for (const auto& t : moving.meshes[0].triangles) corners.insert(corners.end(), t.begin(), t.end());
  tools::GeometrySurface surface = surface_of(moving.meshes[0], static_cast<std::uint32_t>(meshes.size()));
  surface.times = moving.times;
  surface.normals = moving.normals;
  const auto keys = static_cast<std::uint32_t>(moving.times.size());
  return scene_with_shapes(meshes, {ShapeKind::kMovingTriangles, points, corners, keys}, std::move(surface),
                           std::move(materials));
}

/// The scene as the one object of a group.
inline PathTestScene in_instances(PathTestScene scene, const std::vector<build::Instance>& instances) {
  const std::span<const std::byte> file = scene.file.bytes();
  auto bvh = build::build_instances({&file, 1}, instances);
  REQUIRE(bvh.has_value());
  scene.file = std::move(bvh->buffer);
  return scene;
}

/// Object i has material i; @p instances of those, in one group.
inline PathTestScene instanced_scene(const std::vector<oracle::Mesh>& meshes, std::vector<tools::Material> materials,
                                     const std::vector<build::Instance>& instances) {
  std::vector<build::Buffer> files;
  PathTestScene scene{{}, {{}, std::move(materials), {}}};
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    const std::vector<oracle::Mesh> one{meshes[i]};
    auto bvh = build::build(oracle::views(one));
    REQUIRE(bvh.has_value());
    files.push_back(std::move(bvh->buffer));
    scene.surfaces.objects.push_back({surface_of(meshes[i], i)});
  }
  std::vector<std::span<const std::byte>> spans;
  spans.reserve(files.size());
  for (const build::Buffer& file : files) spans.push_back(file.bytes());
  auto bvh = build::build_instances(spans, instances);
  INFO((bvh ? std::string() : bvh.error().message));
  REQUIRE(bvh.has_value());
  scene.file = std::move(bvh->buffer);
  return scene;
}

/// @param sky of every direction.
inline tools::PathData data_of(const PathTestScene& scene, const std::function<Vec3(const Vec3&)>& sky) {
  auto data = tools::make_path_data(scene.view(), &scene.surfaces, tools::make_sky(sky, 32), {}, 0.5f);
  INFO((data ? std::string() : data.error().message));
  REQUIRE(data.has_value());
  return std::move(*data);
}

inline Vec3 black(const Vec3&) { return Vec3(0.0f); }

inline tools::PathPicture trace_well(const PathTestScene& scene, const tools::PathData& data,
                                     const tools::Camera& camera, const tools::PathOptions& options) {
  const BufferView view = scene.view();
  auto picture = tools::trace_paths(make_scene_view(view), data, camera, options);
  INFO((picture ? std::string() : picture.error().message));
  REQUIRE(picture.has_value());
  for (const tools::PathSum& sum : picture->sums) REQUIRE(sum.lost == 0);
  return std::move(*picture);
}

/// The mean of all pixels.
inline glm::dvec3 mean_of(const tools::PathPicture& picture) {
  glm::dvec3 sum(0.0);
  double samples = 0.0;
  for (const tools::PathSum& pixel : picture.sums) {
    sum += glm::dvec3(pixel.sum);
    samples += pixel.samples;
  }
  return sum / samples;
}

inline bool same_sums(const tools::PathPicture& a, const tools::PathPicture& b) {
  return a.sums.size() == b.sums.size() &&
         std::equal(a.sums.begin(), a.sums.end(), b.sums.begin(), [](const auto& x, const auto& y) {
           return x.sum == y.sum && x.squares == y.squares && x.samples == y.samples && x.lost == y.lost;
         });
}

}  // namespace hiprt::test
