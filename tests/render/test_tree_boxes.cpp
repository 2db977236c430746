/// The boxes of a tree level contain the whole scene, on every level, for all instances.

#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <tools/render/studio/tree_boxes.h>

#include <tests/catch.h>

#include <algorithm>
#include <cmath>

using namespace hiprt;
using namespace hiprt::tools;

namespace {

const std::vector<build::Position> kCorners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<build::Triangle> kFaces{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

/// 40 tetrahedra along x.
build::Buffer row(NodeLayout layout) {
  std::vector<build::Position> all;
  std::vector<build::Triangle> faces;
  for (std::uint32_t i = 0; i < 40; ++i) {
    for (const build::Position& p : kCorners) all.push_back({p[0] + 3.0f * static_cast<float>(i), p[1], p[2]});
    for (const build::Triangle& t : kFaces) faces.push_back({t[0] + 4 * i, t[1] + 4 * i, t[2] + 4 * i});
  }
  const std::vector<build::TriangleMesh> meshes{{all, faces}};
  auto bvh = build::build(meshes, {.nodes = layout});
  REQUIRE(bvh.has_value());
  return std::move(bvh->buffer);
}

/// Whether a point is in a box, edges included; boxes here have their first corner's edges along the others.
bool contains(const TreeBoxes& boxes, std::size_t box, const std::array<double, 3>& p) {
  const auto corner = [&](std::size_t k) { return boxes.corners[box * TreeBoxes::kCorners + k]; };
  const build::Position origin = corner(0);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const build::Position end = corner(std::size_t{1} << axis);
    double along = 0, length = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const double edge = double{end[k]} - double{origin[k]};
      along += edge * (p[k] - double{origin[k]});
      length += edge * edge;
    }
    if (along < -1e-3 * length || along > 1.001 * length) return false;
    // Flat ones have no edges along an axis.
    double low = 1e9, high = -1e9;
    for (std::size_t k = 0; k < TreeBoxes::kCorners; ++k) {
      low = std::min(low, double{corner(k)[axis]});
      high = std::max(high, double{corner(k)[axis]});
    }
    if (p[axis] < low - 1e-3 || p[axis] > high + 1e-3) return false;
  }
  return true;
}

bool any_contains(const TreeBoxes& boxes, const std::array<double, 3>& p) {
  for (std::size_t i = 0; i < boxes.count(); ++i)
    if (contains(boxes, i, p)) return true;
  return false;
}

double volume(const TreeBoxes& boxes) {
  double sum = 0;
  for (std::size_t i = 0; i < boxes.count(); ++i) {
    double product = 1;
    const build::Position origin = boxes.corners[i * TreeBoxes::kCorners];
    for (unsigned axis = 0; axis < 3; ++axis) {
      const build::Position end = boxes.corners[i * TreeBoxes::kCorners + (std::size_t{1} << axis)];
      product *= std::hypot(double{end[0]} - double{origin[0]}, double{end[1]} - double{origin[1]},
                            double{end[2]} - double{origin[2]});
    }
    sum += product;
  }
  return sum;
}

}  // namespace

TEST_CASE("tree boxes: on every level all corners of the mesh are in some box, and the boxes shrink") {
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
    const build::Buffer buffer = row(layout);
    const BufferView view = *open_buffer(buffer.bytes());
    double last = 0;
    std::size_t count = 0;
    for (unsigned level = 0; level < 8; ++level) {
      const auto boxes = boxes_of_level(view, level, 0);
      REQUIRE(boxes.has_value());
      CHECK(boxes->triangles.size() == 12 * boxes->count());
      CHECK(boxes->count() >= count);
      const double size = volume(*boxes);
      // Rounded boxes may be a little larger than those around them.
      CHECK((level == 0 || size <= 1.05 * last));
      for (unsigned i = 0; i < 40; ++i)
        for (const build::Position& p : kCorners)
          REQUIRE(any_contains(*boxes, {double{p[0]} + 3.0 * i, double{p[1]}, double{p[2]}}));
      last = size;
      count = boxes->count();
    }
    CHECK(boxes_of_level(view, 0, 0)->count() == 1);
    CHECK(boxes_of_level(view, 100, 0)->count() == count);
    CHECK(count > 20);
  }
}

TEST_CASE("tree boxes: the boxes of an instance's object turn and move with the instance") {
  const build::Buffer object = row(NodeLayout::kPlanes);
  const float h = std::sqrt(0.5f);
  const build::Motion motion{.keys = {{.time = 0, .rotation = {0, 0, h, h}},
                                      {.time = 1, .translation = {0, 0, 50}, .rotation = {0, 0, h, h}}}};
  const std::vector<std::span<const std::byte>> files{object.bytes()};
  for (const double budget : {1.0, 4.0}) {
    const std::vector<build::Instance> instances{{.motion = &motion},
                                                 {.to_scene = {{{1, 0, 0, -200}, {0, 1, 0, 0}, {0, 0, 1, 0}}}}};
    const auto scene = build::build_instances(files, instances, {.opening_budget = budget, .open_largest = true});
    REQUIRE(scene.has_value());
    const BufferView view = *open_buffer(scene->buffer.bytes());
    for (const float time : {0.0f, 0.5f, 1.0f}) {
      const auto boxes = boxes_of_level(view, 20, time);
      REQUIRE(boxes.has_value());
      for (unsigned i = 0; i < 40; ++i) {
        // A quarter turn about z: x becomes y.
        CHECK(any_contains(*boxes, {0.0, 3.0 * i + 1.0, 50.0 * static_cast<double>(time)}));
        CHECK(any_contains(*boxes, {-200.0 + 3.0 * i, 0.0, 1.0}));
      }
      CHECK_FALSE(any_contains(*boxes, {60.0, 0.0, 0.0}));
      // Apart from the one of all times, no box is longer than a few tetrahedra.
      for (const build::Position& p : boxes->corners) CHECK(p[2] <= 50.0f * time + 1.001f);
    }
  }
}

TEST_CASE("tree boxes: an empty tree has none") {
  const auto bvh = build::build(build::SceneInput{});
  REQUIRE(bvh.has_value());
  const auto boxes = boxes_of_level(*open_buffer(bvh->buffer.bytes()), 3, 0);
  REQUIRE_FALSE(boxes.has_value());
  CHECK(boxes.error().code == build::ErrorCode::kInvalidInput);
}
