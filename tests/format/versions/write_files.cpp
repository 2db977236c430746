/// Writes the golden files of one version of the format. README.md says how to compile this with an old library.
/// usage: write_files FOLDER. GOLDEN_MINOR is the minor version of an old library, which lacks some functions.

#ifndef GOLDEN_MINOR
#define GOLDEN_MINOR 1000  // This library's.
#endif

#include "golden_input.h"

#include <hiprt_build/file.h>

#if GOLDEN_MINOR >= 2
#include <hiprt_build/instances.h>
#endif
#if GOLDEN_MINOR >= 3
#include <hiprt_build/shapes.h>
#endif

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

namespace {

using namespace hiprt;
using namespace hiprt::golden;

std::string folder;

template <class Made> build::Buffer write(const char* name, Made made) {
  if (made) {
    const auto written = build::write_file(folder + "/" + name + ".bvh", made->buffer.bytes());
    if (written) return std::move(made->buffer);
    std::fprintf(stderr, "%s: %s\n", name, written.error().message.c_str());
  } else {
    std::fprintf(stderr, "%s: %s\n", name, made.error().message.c_str());
  }
  std::exit(1);
}

build::TriangleMesh view_of(const Mesh& mesh, std::uint32_t mask = 0xffffffffu) {
  build::TriangleMesh view;
  view.positions = mesh.positions;
  view.triangles = mesh.triangles;
  view.mask = mask;
  return view;
}

build::BuildOptions in_layout(NodeLayout layout) {
  build::BuildOptions options;
  options.builder = build::Builder::kSah;
  options.nodes = layout;
  options.max_leaf_triangles = 2;
  options.tool = "write_files";
  return options;
}

void write_triangles() {
  const Mesh squares = tiles(), triangle = flag(), thin = slivers();
  const std::vector<build::TriangleMesh> meshes{view_of(squares), view_of(triangle, 2)}, cut{view_of(thin)};
  write("float", build::build(meshes, in_layout(NodeLayout::kFloat)));
  write("planes", build::build(meshes, in_layout(NodeLayout::kPlanes)));
  build::BuildOptions splits = in_layout(NodeLayout::kPlanes);
#if GOLDEN_MINOR == 0
  splits.builder = build::Builder::kEmbreeHigh;
#else
  splits.builder = build::Builder::kSbvh;
#if GOLDEN_MINOR >= 8
  // Spatial splits do not pay in so small a scene.
  splits.builder = build::Builder::kHploc;
  splits.presplit_budget = 2;
#endif
  write("half", build::build(meshes, in_layout(NodeLayout::kHalf)));
  write("quantized", build::build(meshes, in_layout(NodeLayout::kQuantized)));
#endif
  write("split", build::build(cut, splits));
  write("empty", build::build(std::vector<build::TriangleMesh>{}, in_layout(NodeLayout::kFloat)));
#if GOLDEN_MINOR >= 8
  const Mesh row = field();
  write("gaps", build::build(std::vector<build::TriangleMesh>{view_of(row)}, in_layout(NodeLayout::kPlanes)));
#endif
#if GOLDEN_MINOR >= 6
  build::BuildOptions wide = in_layout(NodeLayout::kFloat);
  wide.widen_boxes = true;
  write("widened", build::build(meshes, wide));
#endif
}

#if GOLDEN_MINOR >= 1
void write_customs() {
  const Mesh squares = tiles();
  const std::vector<build::TriangleMesh> meshes{view_of(squares)};
  const std::vector<Box> cubes = boxes();
  std::vector<build::CustomGeometry> customs(1);
  customs[0].boxes = cubes;
  customs[0].type = kBoxType;
  build::SceneInput scene;
  scene.meshes = meshes;
  scene.customs = customs;
  write("customs", build::build(scene, in_layout(NodeLayout::kPlanes)));
  write("customs_half", build::build(scene, in_layout(NodeLayout::kHalf)));
}
#endif

#if GOLDEN_MINOR >= 2
build::InstanceOptions over_instances(double opening = 1) {
  build::InstanceOptions options;
  options.tree.tool = "write_files";
  options.opening_budget = opening;
#if GOLDEN_MINOR >= 6
  // Older libraries open without asking whether rays gain by it.
  options.open_largest = true;
#endif
  return options;
}

build::Instance at(float x, float y, float z = 0) {
  build::Instance instance;
  instance.to_scene.row[0][3] = x;
  instance.to_scene.row[1][3] = y;
  instance.to_scene.row[2][3] = z;
  return instance;
}

/// Instance 0 is moved, 1 is turned and doubled, 2 is mirrored and has mask 2.
std::vector<build::Instance> three_instances() {
  std::vector<build::Instance> instances{at(0, 0), at(30, kRow), at(-20, 2 * kRow)};
  auto& turned = instances[1].to_scene.row;
  turned[0][0] = turned[1][1] = 0;
  turned[0][1] = -2;
  turned[1][0] = turned[2][2] = 2;
  instances[2].to_scene.row[0][0] = -1;
  instances[2].mask = 2;
  for (std::uint32_t i = 0; i < 3; ++i) instances[i].id = kFirstId + i;
  return instances;
}

/// One instance per kind of motion, behind each other along y, and one that stands still.
void write_motion(std::span<const std::span<const std::byte>> files) {
  build::MotionKey first, last;
  last.time = 1;
  last.translation[0] = kMove;
  last.rotation[2] = last.rotation[3] = kSine45;
  std::vector<build::Motion> motions(3);
  motions[0].kind = MotionKind::kSlerp;
  motions[1].kind = MotionKind::kNlerp;
  motions[2].kind = MotionKind::kMatrix;
  build::MatrixKey begin, end;
  begin.to_scene = at(0, 2 * kRow).to_scene;
  end.to_scene = at(kMove, 2 * kRow).to_scene;
  end.time = 1;
  motions[2].matrices = {begin, end};
  for (int i = 0; i < 2; ++i) {
    first.translation[1] = last.translation[1] = kRow * static_cast<float>(i);
    motions[static_cast<std::size_t>(i)].keys = {first, last};
  }
#if GOLDEN_MINOR >= 5
  // Instance 4 shrinks to nothing.
  motions.emplace_back();
  motions[3].kind = MotionKind::kMatrix;
  begin.to_scene = at(0, 4 * kRow).to_scene;
  end.to_scene = at(0, 4 * kRow).to_scene;
  for (int axis = 0; axis < 3; ++axis) end.to_scene.row[axis][axis] = 0;
  motions[3].matrices = {begin, end};
#endif
  std::vector<build::Instance> instances(3);
  for (std::size_t i = 0; i < 3; ++i) instances[i].motion = &motions[i];
  instances.push_back(at(0, 3 * kRow));
  if (motions.size() > 3) {
    instances.emplace_back();
    instances.back().motion = &motions[3];
  }
  for (std::uint32_t i = 0; i < instances.size(); ++i) instances[i].id = kFirstId + i;
  write("motion", build::build_instances(files, instances, over_instances()));
}

/// A pair of instances, twice. Both levels are opened: an instance has several leaves.
void write_nested(std::span<const std::span<const std::byte>> files) {
  const std::vector<build::Instance> pair{at(0, 0), at(0, kRow)};
  std::vector<build::Instance> pairs{at(0, 0), at(20, 0)};
  for (build::Instance& instance : pairs) instance.object = 1;
  const std::vector<std::span<const build::Instance>> groups{pair, pairs};
  build::InstancedScene scene;
  scene.files = files;
  scene.groups = groups;
  write("nested", build::build_instances(scene, over_instances(3)));
}

void write_instances() {
  const Mesh squares = tiles();
  const std::vector<build::TriangleMesh> meshes{view_of(squares)};
  std::vector<build::Buffer> objects;
  for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kFloat, NodeLayout::kHalf, NodeLayout::kQuantized}) {
    auto object = build::build(meshes, in_layout(layout));
    if (!object) std::exit(1);
    objects.push_back(std::move(object->buffer));
  }
  std::vector<std::span<const std::byte>> files;
  for (const build::Buffer& object : objects) files.push_back(object.bytes());
  const std::span<const std::span<const std::byte>> all = files;
  write("instances", build::build_instances(all.subspan(0, 1), three_instances(), over_instances()));
  write("instances_half", build::build_instances(all.subspan(2, 1), three_instances(), over_instances()));
  write_nested(all.subspan(3, 1));
  write_motion(all.subspan(1, 1));
}
#endif

#if GOLDEN_MINOR >= 3
/// A file of custom geometries, and a scene of three instances of it.
void write_customs_and_instances(const char* name, const char* scene_name,
                                 const std::vector<build::CustomGeometry>& customs, NodeLayout layout) {
  build::SceneInput scene;
  scene.customs = customs;
  const build::Buffer object = write(name, build::build(scene, in_layout(layout)));
  const std::vector<std::span<const std::byte>> files{object.bytes()};
  write(scene_name, build::build_instances(files, three_instances(), over_instances()));
}

void write_shapes() {
  const std::vector<ShapePoint> centres{{{0, 30, 0}, 0.5f}, {{3, 30, 0}, 0.5f}, {{6, 30, 0}, 0.5f}};
  const std::vector<ShapePoint> axis{{{0, 35, 0}, 0.25f}, {{2, 35, 0}, 0.25f}, {{4, 35, 0}, 0.25f}};
  const std::vector<std::uint32_t> segments{0, 1};
  build::Shapes spheres, curves;
  spheres.kind = ShapeKind::kSpheres;
  spheres.points = centres;
  curves.kind = ShapeKind::kCurves;
  curves.points = axis;
  curves.segments = segments;
  const auto sphere_boxes = build::shape_boxes(spheres), curve_boxes = build::shape_boxes(curves);
  if (!sphere_boxes || !curve_boxes) std::exit(1);
  std::vector<build::CustomGeometry> customs(2);
  customs[0].boxes = *sphere_boxes;
  customs[0].shapes = spheres;
  customs[1].boxes = *curve_boxes;
  customs[1].shapes = curves;
  customs[1].type = 1;
  write_customs_and_instances("shapes", "shape_instances", customs, NodeLayout::kPlanes);
}
#endif

#if GOLDEN_MINOR >= 5
void write_types() {
  const Mesh squares = tiles();
  std::vector<build::TriangleMesh> meshes{view_of(squares)};
  meshes[0].type = kLargeType;
  const std::vector<Box> cubes = boxes();
  std::vector<build::CustomGeometry> customs(1);
  customs[0].boxes = cubes;
  customs[0].type = kLargeType;
  write("types", build::build(build::SceneInput{meshes, customs}, in_layout(NodeLayout::kQuantized)));
}
#endif

#if GOLDEN_MINOR >= 7
/// Two triangles of a square that moves along x from time -1 to 1, and rises in the second half.
void write_moving_shapes() {
  std::vector<ShapePoint> points;
  for (const auto& [x, z] : {std::pair{0.0f, 0.0f}, {8.0f, 0.0f}, {16.0f, 4.0f}}) {
    for (const auto& [dx, dy] : {std::pair{0.0f, 0.0f}, {1.0f, 0.0f}, {1.0f, 1.0f}, {0.0f, 1.0f}})
      points.push_back({{x + dx, 50 + dy, z}, x / 8 - 1});
  }
  const std::vector<std::uint32_t> corners{0, 1, 2, 0, 2, 3};
  const build::Shapes square{ShapeKind::kMovingTriangles, points, corners, 3};
  const auto square_boxes = build::shape_boxes(square);
  if (!square_boxes) std::exit(1);
  std::vector<build::CustomGeometry> customs(1);
  customs[0].boxes = *square_boxes;
  customs[0].shapes = square;
  write_customs_and_instances("moving_shapes", "moving_shape_instances", customs, NodeLayout::kHalf);
}
#endif

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: write_files FOLDER\n");
    return 2;
  }
  folder = argv[1];
  write_triangles();
#if GOLDEN_MINOR >= 1
  write_customs();
#endif
#if GOLDEN_MINOR >= 2
  write_instances();
#endif
#if GOLDEN_MINOR >= 3
  write_shapes();
#endif
#if GOLDEN_MINOR >= 5
  write_types();
#endif
#if GOLDEN_MINOR >= 7
  write_moving_shapes();
#endif
  return 0;
}
