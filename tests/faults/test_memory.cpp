// Allocations of the library that fail: each gives one error or is survived, nothing leaks, and the next call works.

#include <hiprt_build/build.h>
#include <hiprt_build/exchange.h>
#include <hiprt_build/exec/threads.h>
#include <hiprt_build/file.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_build/merge_levels.h>
#include <hiprt_build/open_scene.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/shapes.h>
#include <hiprt_build/trace_rays.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/faults/every_allocation.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/motions.h>
#include <tests/tools/temp_folder.h>

#include <array>
#include <cstring>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

/// Not Embree's: where its own allocations fail, Embree ends the program (RELIABILITY.md).
constexpr std::array kBuilders{build::Builder::kSah,  build::Builder::kLbvh,  build::Builder::kLbvh30,
                               build::Builder::kPloc, build::Builder::kHploc, build::Builder::kSbvh,
                               build::Builder::kHq};

/// Two meshes and boxes.
struct Scene {
  std::vector<oracle::Mesh> meshes{oracle::star(3, kFaultSeed), oracle::torus(9, 7, 0.3)};
  std::vector<build::TriangleMesh> views = oracle::views(meshes);
  std::vector<Box> boxes = std::vector<Box>(50, Box{{0, 0, 0}, {1, 1, 1}});
  std::vector<build::CustomGeometry> customs{{boxes, 0}};

  build::SceneInput input(bool with_customs = true) const {
    return {views, with_customs ? std::span(customs) : std::span<const build::CustomGeometry>{}};
  }
};

/// A star that turns: triangles at three times.
struct MovingStar {
  std::vector<ShapePoint> points;
  std::vector<std::uint32_t> corners;
  std::vector<Box> boxes;

  /// @param turn of the last key.
  explicit MovingStar(double turn) {
    const oracle::Mesh star = oracle::star(3, kFaultSeed);
    for (unsigned key = 0; key < 3; ++key)
      for (const auto& p : oracle::twisted(star, 0.5 * turn * key).positions)
        points.push_back({{p[0], p[1], p[2]}, static_cast<float>(key)});
    for (const build::Triangle& t : star.triangles) corners.insert(corners.end(), t.begin(), t.end());
    auto found = build::shape_boxes(shapes());
    REQUIRE(found.has_value());
    boxes = std::move(*found);
  }
  build::Shapes shapes() const { return {ShapeKind::kMovingTriangles, points, corners, 3}; }
  build::CustomGeometry custom() const { return {.boxes = boxes, .type = 2, .shapes = shapes()}; }
};

template <class T> T must(build::Result<T> result) {
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

build::Result<std::vector<Hit>> traced(const SceneView& view) {
  std::vector<Ray> rays(100, Ray{.origin = {0.1f, 0.2f, 5}, .direction = {0, 0, -1}});
  std::vector<Hit> hits(rays.size());
  if (auto done = closest_hits(view, rays, hits); !done) return tl::unexpected(done.error());
  return hits;
}

}  // namespace

TEST_CASE("allocations that fail: builders") {
  const Scene scene;
  std::uint64_t with_sizes = 0;
  for (const build::Builder builder : kBuilders)
    for (const bool with_customs : {false, true}) {
      const build::BuildOptions options{
          .builder = builder, .threads = 1, .presplit_budget = 1.2, .reinsertion_rounds = 2};
      with_sizes += check_every_allocation(build::name(builder), kMost, [&] {
                      return build::build(scene.input(with_customs), options);
                    }).with_sizes;
    }
  CHECK(with_sizes > 0);
}

TEST_CASE("allocations that fail: triangles that move") {
  const MovingStar star(1.0), moved(2.0);
  const build::CustomGeometry custom = star.custom(), other = moved.custom();
  const build::SceneInput input{{}, {&custom, 1}}, changed{{}, {&other, 1}};
  check_every_allocation("shape_boxes", kMost, [&] { return build::shape_boxes(star.shapes(), 1); });
  for (const build::Builder builder : kBuilders)
    check_every_allocation(std::string(build::name(builder)) + " of moving triangles", kMost, [&] {
      return build::build(input, {.builder = builder, .threads = 1, .reinsertion_rounds = 2});
    });
  const build::Bvh bvh = must(build::build(input, {.threads = 1}));
  const auto bytes = std::as_const(bvh).buffer.bytes();
  check_every_allocation("refit_copy of moving triangles", kMost,
                         [&] { return build::refit_copy(bytes, changed, {.threads = 1}); });
  const std::vector<build::Instance> instances(5);
  build::InstanceOptions options;
  options.tree.threads = 1;
  check_every_allocation("build_instances of moving triangles", kMost, [&] {
    return build::build_instances({&bytes, 1}, instances, options);
  });
  check_every_allocation("open_scene of moving triangles", kMost, [&] { return open_scene(bytes); });
}

TEST_CASE("allocations that fail: builders with several threads") {
  const Scene scene;
  const build::Threads::Limit workers(4);
  for (const build::Builder builder : {build::Builder::kSbvh, build::Builder::kHploc})
    check_every_allocation(build::name(builder), kMost,
                           [&] { return build::build(scene.input(), {.builder = builder, .threads = 4}); });
}

TEST_CASE("allocations that fail: imported and exported trees") {
  const Scene scene;
  const build::Threads::Limit workers(1);
  const build::Bvh bvh = must(build::build(scene.input(), {.threads = 1}));
  const BufferView view = *open_buffer(bvh.buffer.bytes());
  const build::ExchangeBvh tree = must(build::export_tree(view));
  check_every_allocation("export_tree", kMost, [&] { return build::export_tree(view); });
  check_every_allocation("validate(tree)", kMost, [&] { return build::validate(tree, scene.input()); });
  check_every_allocation("import_tree", kMost, [&] { return build::import_tree(scene.input(), tree, {.threads = 1}); });
}

TEST_CASE("allocations that fail: refits, also in place, which then change nothing") {
  Scene scene;
  const build::Bvh bvh = must(build::build(scene.input(), {.threads = 1}));
  const std::vector<oracle::Mesh> moved{oracle::twisted(scene.meshes[0], 0.5), scene.meshes[1]};
  const auto views = oracle::views(moved);
  const build::SceneInput input{views, scene.customs};
  const build::RefitOptions options{.threads = 1};
  check_every_allocation("refit_copy", kMost,
                         [&] { return build::refit_copy(std::as_const(bvh).buffer.bytes(), input, options); });
  build::Buffer file(bvh.buffer.size());
  const auto restore = [&] { std::memcpy(file.bytes().data(), bvh.buffer.bytes().data(), file.size()); };
  bool unchanged = true;
  check_every_allocation("refit", kMost, [&] {
    restore();
    auto result = build::refit(file.bytes(), input, options);
    if (!result) unchanged = unchanged && std::memcmp(file.bytes().data(), bvh.buffer.bytes().data(), file.size()) == 0;
    return result;
  });
  CHECK(unchanged);
}

TEST_CASE("allocations that fail: scenes of instances and merged levels") {
  const Scene scene;
  const build::Bvh bvh = must(build::build(scene.input(false), {.threads = 1}));
  const std::vector<std::span<const std::byte>> files{bvh.buffer.bytes()};
  std::vector<build::Instance> group(5), top(7);
  for (std::size_t i = 0; i < top.size(); ++i) {
    top[i].object = 1;
    top[i].to_scene.row[0][3] = 3.0f * static_cast<float>(i);
  }
  const std::vector<std::span<const build::Instance>> groups{group, top};
  const build::InstancedScene instanced{files, groups};
  for (const double opening : {1.0, 3.0}) {
    build::InstanceOptions options{.opening_budget = opening, .open_largest = true};
    options.tree.threads = 1;
    check_every_allocation("build_instances", kMost, [&] { return build::build_instances(instanced, options); });
  }
  check_every_allocation("merge_levels", kMost, [&] { return build::merge_levels(instanced); });
}

TEST_CASE("allocations that fail: shapes, files and many rays") {
  const Scene scene;
  const build::Bvh bvh = must(build::build(scene.input(false), {.threads = 1}));
  const test::TempFolder folder;
  const std::filesystem::path file = folder / "a.bvh";
  const std::string path = file;
  const auto bytes = std::as_const(bvh).buffer.bytes();
  check_every_allocation("write_file", kMost, [&] { return build::write_file(file, bytes); });
  CHECK(folder.names() == std::vector<std::string>{"a.bvh"});
  check_every_allocation("check_writable", kMost, [&] { return build::check_writable(file); });
  check_every_allocation("open_scene(path)", kMost, [&] { return open_scene(path); });
  std::vector<std::byte> odd(bytes.size() + 4);
  std::memcpy(odd.data() + 4, bytes.data(), bytes.size());
  check_every_allocation("open_scene(bytes)", kMost, [&] { return open_scene(std::span(odd).subspan(4)); });
  check_every_allocation("closest_hits", kMost, [&]() -> build::Result<std::vector<Hit>> {
    const auto opened = open_scene(bytes);
    if (!opened) return tl::unexpected(opened.error());
    const SceneView view = opened->scene();
    // The test's own arrays are not part of it.
    stop_failing();
    return traced(view);
  });
}
