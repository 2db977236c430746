/// bvhtrace on scenes of instances: hits and instance paths with every option of the tracer, and invalid input.

#include "programs.h"

#include <hiprt_build/file.h>
#include <hiprt_build/instances.h>
#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using build::Instance;
using nlohmann::json;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

/// A square [0, 1]^2 of two triangles at z; primitive 1 is above the diagonal.
struct Square {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};

  explicit Square(float z) : positions{{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}} {}
  build::TriangleMesh view() const { return {positions, triangles}; }
};

build::Buffer object(const std::vector<Square>& squares, NodeLayout layout = NodeLayout::kPlanes) {
  std::vector<build::TriangleMesh> meshes;
  meshes.reserve(squares.size());
  for (const Square& square : squares) meshes.push_back(square.view());
  auto bvh = build::build(meshes, {.nodes = layout});
  REQUIRE(bvh.has_value());
  return std::move(bvh->buffer);
}

Instance at(std::uint32_t object, float x, float y, float z, std::uint32_t id = 0) {
  Instance instance{.object = object, .id = id};
  instance.to_scene.row[0][3] = x;
  instance.to_scene.row[1][3] = y;
  instance.to_scene.row[2][3] = z;
  return instance;
}

/// @return the path of the scene file.
std::string write_scene(const TempFolder& folder, const std::vector<build::Buffer>& files,
                        const std::vector<std::vector<Instance>>& groups) {
  std::vector<std::span<const std::byte>> bytes;
  bytes.reserve(files.size());
  for (const build::Buffer& file : files) bytes.push_back(file.bytes());
  const std::vector<std::span<const Instance>> spans(groups.begin(), groups.end());
  const auto bvh = build::build_instances(build::InstancedScene{bytes, spans});
  INFO((bvh ? std::string() : bvh.error().message));
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / "i.bvh", bvh->buffer.bytes()).has_value());
  return folder / "i.bvh";
}

/// Object 0: a square at z = 0. Object 1: one at z = 0 and one at z = 1, a geometry each. Object 2, a group: object 0
/// (id 10) and object 1 (id 11), 4 to the right. The scene: object 2 (id 20), the same 10 above (id 21), and object 0
/// far to the left (id 22).
std::string write_town(const TempFolder& folder, NodeLayout layout = NodeLayout::kPlanes) {
  std::vector<build::Buffer> files;
  files.push_back(object({Square(0)}, layout));
  files.push_back(object({Square(0), Square(1)}, layout));
  return write_scene(
      folder, files,
      {{at(0, 0, 0, 0, 10), at(1, 4, 0, 0, 11)}, {at(2, 0, 0, 0, 20), at(2, 0, 10, 0, 21), at(0, -20, 0, 0, 22)}});
}

/// Down from z = 10; t is in lengths of the direction, 2.
Ray down(float x, float y) {
  Ray ray;
  ray.origin = {x, y, 10};
  ray.direction = {0, 0, -2};
  return ray;
}

/// Below the diagonal of a square whose corner is at x, y.
Ray low(float x, float y) { return down(x + 0.75f, y + 0.25f); }
Ray high(float x, float y) { return down(x + 0.25f, y + 0.75f); }

struct Traced {
  json summary;
  std::vector<tools::HitRecord> hits;
  tools::RayPaths paths;
};

Traced trace(const TempFolder& folder, const std::string& scene, const std::vector<Ray>& rays,
             const std::vector<std::string>& options = {}) {
  const std::string ray_file = folder / "r.rays", hits = folder / "r.hits", paths = folder / "r.paths";
  REQUIRE(tools::write_rays(ray_file, false, rays).has_value());
  std::vector<std::string> command{kBvhTrace, scene, "--rays", ray_file, "--hits", hits, "--paths", paths, "--json"};
  command.insert(command.end(), options.begin(), options.end());
  const CommandResult result = run(command);
  INFO(result.err);
  REQUIRE(result.status == 0);
  Traced traced;
  traced.summary = json::parse(result.out);
  traced.hits = tools::read_hits(hits).value();
  traced.paths = tools::read_paths(paths).value();
  REQUIRE(traced.hits.size() == rays.size());
  REQUIRE(traced.paths.paths.size() == rays.size() * traced.paths.levels);
  return traced;
}

using Path = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Number and id of the instances on the path to a hit.
Path path_of(const Traced& traced, std::size_t ray) {
  Path path;
  for (std::size_t k = 0; k < traced.paths.levels; ++k) {
    const tools::PathRecord& record = traced.paths.paths[ray * traced.paths.levels + k];
    path.emplace_back(record.instance, record.id);
  }
  return path;
}

}  // namespace

TEST_CASE("Programs: bvhtrace writes hits of instances and their paths, with every choice of the tracer") {
  const TempFolder folder;
  constexpr std::uint32_t kNone = kInvalidId;
  const std::vector<Ray> rays{low(0, 0), high(4, 10), low(4, 0), low(-20, 0), low(2, 0)};
  for (const NodeLayout layout : {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized}) {
    const std::string scene = write_town(folder, layout);
    for (const std::string triangle_test : {"watertight", "fast", "reference"})
      for (const std::string box_test : {"conservative", "plain"}) {
        if (triangle_test == "reference" && box_test == "plain") continue;
        INFO(static_cast<unsigned>(layout) << " " << triangle_test << " " << box_test);
        const Traced traced =
            trace(folder, scene, rays, {"--triangle-test", triangle_test, "--box-test", box_test, "--device", "cpu"});
        CHECK(traced.summary["levels"] == 2);
        CHECK(traced.summary["hits"] == 4);
        CHECK(traced.paths.levels == 2);
        CHECK((traced.hits[0].t == 5.0f && traced.hits[0].primitive == 0));
        CHECK(path_of(traced, 0) == Path{{0, 20}, {0, 10}});
        // The upper of two squares, geometry 1: primitives are numbered over the object's geometries.
        CHECK((traced.hits[1].t == 4.5f && traced.hits[1].primitive == 3));
        CHECK(path_of(traced, 1) == Path{{1, 21}, {1, 11}});
        CHECK((traced.hits[2].t == 4.5f && traced.hits[2].primitive == 2));
        CHECK(path_of(traced, 2) == Path{{0, 20}, {1, 11}});
        CHECK((traced.hits[3].t == 5.0f && traced.hits[3].primitive == 0));
        CHECK(path_of(traced, 3) == Path{{2, 22}, {kNone, kNone}});
        CHECK((traced.hits[4].t == kInf && traced.hits[4].primitive == kNone));
        CHECK(path_of(traced, 4) == Path{{kNone, kNone}, {kNone, kNone}});
        const Traced any = trace(folder, scene, rays, {"--query", "any", "--triangle-test", triangle_test});
        CHECK(any.summary["hits"] == 4);
        CHECK(path_of(any, 1) == Path{{1, 21}, {1, 11}});
      }
  }
}

TEST_CASE("Programs: scenes of one level and of 32 are traced, one of 33 is refused with both numbers") {
  const TempFolder folder;
  std::vector<build::Buffer> files;
  files.push_back(object({Square(0)}));
  std::vector<std::vector<Instance>> groups;
  for (std::uint32_t level = 0; level < 33; ++level) {
    groups.push_back({at(level, 1, 0, 0, 100 + level)});
    const std::string scene = write_scene(folder, files, groups);
    const auto depth = static_cast<float>(level + 1);
    if (level + 1 != 1 && level + 1 != 2 && level + 1 != 32 && level + 1 != 33) continue;
    INFO(depth << " levels");
    if (level + 1 == 33) {
      check_failure(folder, {kBvhTrace, scene, "--rays", folder / "r.rays", "--hits", folder / "r.hits"},
                    "i.bvh: 33 levels of instances, the limit is 32", {"i.bvh", "r.hits", "r.paths", "r.rays"});
      continue;
    }
    const Traced traced = trace(folder, scene, {low(depth, 0), low(depth + 1, 0)});
    CHECK((traced.hits[0].t == 5.0f && traced.hits[0].primitive == 0));
    CHECK(traced.hits[1].t == kInf);
    const Path path = path_of(traced, 0);
    REQUIRE(path.size() == level + 1);
    for (std::uint32_t k = 0; k <= level; ++k) CHECK(path[k] == std::pair(0u, 100 + level - k));
  }
}

TEST_CASE("Programs: the path of a hit in a scene without instances is empty") {
  const TempFolder folder;
  REQUIRE(build::write_file(folder / "flat.bvh", object({Square(0)}).bytes()).has_value());
  const Traced traced = trace(folder, folder / "flat.bvh", {low(0, 0), low(2, 0)});
  CHECK(traced.summary["levels"] == 0);
  CHECK(traced.summary["hits"] == 1);
  CHECK(traced.paths.levels == 0);
  CHECK(read_file(folder / "r.paths") == std::string("\2\0\0\0\0\0\0\0", 8));
}

TEST_CASE("Programs: a scene with an empty group, or of empty objects, is traced") {
  const TempFolder folder;
  std::vector<build::Buffer> files;
  files.push_back(object({}));
  for (const auto& group : {std::vector<Instance>{}, std::vector<Instance>{at(0, 1, 0, 0)}}) {
    const Traced traced = trace(folder, write_scene(folder, files, {group}), {low(0, 0)});
    CHECK(traced.summary["hits"] == 0);
    CHECK(traced.hits[0].t == kInf);
  }
}

TEST_CASE("Programs: objects with custom primitives are refused, and path files that are the other files") {
  const TempFolder folder;
  const std::string rays = folder / "r.rays", hits = folder / "r.hits";
  REQUIRE(tools::write_rays(rays, false, std::vector<Ray>{low(0, 0)}).has_value());
  const std::vector<Box> boxes{{{0, 0, 0}, {1, 1, 1}}};
  const std::vector<build::CustomGeometry> customs{{boxes, 1}};
  auto ball = build::build(build::SceneInput{{}, customs});
  REQUIRE(ball.has_value());
  std::vector<build::Buffer> files;
  files.push_back(std::move(ball->buffer));
  const std::string odd = write_scene(folder, files, {{at(0, 0, 0, 0)}});
  check_failure(folder, {kBvhTrace, odd, "--rays", rays, "--hits", hits}, "i.bvh: has custom primitives",
                {"i.bvh", "r.rays"});
  const std::string town = write_town(folder);
  const auto refuses = [&](const std::string& paths, const std::string& word) {
    check_failure(folder, {kBvhTrace, town, "--rays", rays, "--hits", hits, "--paths", paths}, word,
                  {"i.bvh", "r.rays"});
  };
  refuses(hits, "r.hits: --hits and --paths are one file");
  refuses(folder / "./r.hits", "--hits and --paths are one file");
  refuses(rays, "r.rays: the output is one of the inputs");
  refuses(town, "i.bvh: the output is one of the inputs");
  refuses(folder / "no/such/r.paths", "no/such/r.paths");
}
