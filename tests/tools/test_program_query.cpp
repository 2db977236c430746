/// bvhquery: results against exact arithmetic and values by hand, through instances, for any number of threads.

#include "query_runs.h"

#include <hiprt_build/file.h>
#include <hiprt_build/instances.h>
#include <tests/amount.h>
#include <tests/catch.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/point_triangle.h>
#include <tests/oracle/random.h>
#include <tools/scene_io/rays_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

using namespace hiprt;
using namespace hiprt::test;
using oracle::Mesh;
using oracle::Random;
using oracle::Rational;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

std::string obj_of(const Mesh& mesh) {
  std::string text;
  char line[120];
  for (const auto& p : mesh.positions) {
    std::snprintf(line, sizeof(line), "v %.9g %.9g %.9g\n", double{p[0]}, double{p[1]}, double{p[2]});
    text += line;
  }
  for (const auto& t : mesh.triangles)
    text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
  return text;
}

/// Triangles at random places, and a builder that splits them.
struct Soup {
  Mesh mesh;
  Random random;

  explicit Soup(std::uint64_t seed) : random(seed) {
    for (std::uint32_t i = 0; i < 60; ++i) {
      const auto at = random.in_cube(2.0);
      for (unsigned k = 0; k < 3; ++k) {
        const auto off = random.in_cube(i % 4 == 0 ? 2.0 : 0.3);
        mesh.positions.push_back({at[0] + off[0], at[1] + off[1], at[2] + off[2]});
      }
      mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
  }
  std::string build(const TempFolder& folder, const std::string& builder) const {
    const std::string obj = folder.write("soup.obj", obj_of(mesh));
    std::string bvh = folder / "soup.bvh";
    check_quiet(run({kBvhBuild, obj, "-o", bvh, "--builder", builder}));
    return bvh;
  }
  /// The exact squared distances of all triangles.
  std::vector<Rational> distances(const float* p) const {
    std::vector<Rational> result;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      result.push_back(oracle::squared_distance(oracle::exact3(double{p[0]}, double{p[1]}, double{p[2]}),
                                                oracle::exact_corners(oracle::corners(mesh, t))));
    return result;
  }
  std::vector<float> queries(std::size_t count, unsigned width) {
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i) {
      const auto p = random.in_cube(3.0);
      values.insert(values.end(), p.begin(), p.end());
      if (width == 4) values.push_back(random.uniform_float(0.1, 1.5));
    }
    return values;
  }
};

bool near_root(float distance, const Rational& squared) {
  return std::abs(static_cast<double>(distance) - std::sqrt(squared.get_d())) <= 1e-6;
}

/// The distance from the cube [-1, 1]^3, negative inside.
double from_cube(const float* p) {
  double outside = 0, inside = -kInf;
  for (int k = 0; k < 3; ++k) {
    const double d = std::abs(static_cast<double>(p[k])) - 1.0;
    outside += d > 0 ? d * d : 0;
    inside = std::max(inside, d);
  }
  return inside > 0 ? std::sqrt(outside) : inside;
}

const char* const kCube =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

}  // namespace

TEST_CASE("bvhquery: closest and nearest triangles are those of exact arithmetic, also where a builder splits") {
  const TempFolder folder;
  Soup soup(751);
  const std::vector<float> points = soup.queries(checks::trials(1500), 3);
  for (const std::string builder : {"sbvh", "lbvh"}) {
    QueryRuns runs(folder, soup.build(folder, builder));
    runs.points(points);
    const ResultFile closest = runs.ask("closest"), nearest = runs.ask("nearest", {"-k", "5"});
    REQUIRE((closest.count == points.size() / 3 && closest.each == 1 && nearest.each == 5));
    CHECK(runs.summary["found"] == closest.count);
    for (std::size_t i = 0; i < closest.count; ++i) {
      INFO(builder << ", point " << i << " of seed 751");
      const std::vector<Rational> exact = soup.distances(&points[3 * i]);
      std::vector<Rational> sorted = exact;
      std::sort(sorted.begin(), sorted.end());
      const tools::PointRecord& near = closest.points[i];
      CHECK((near_root(near.distance, sorted[0]) && near_root(near.distance, exact.at(near.primitive))));
      const double from = std::hypot(double{near.x - points[3 * i]}, double{near.y - points[3 * i + 1]},
                                     double{near.z - points[3 * i + 2]});
      CHECK(std::abs(from - double{near.distance}) < 1e-5);
      for (std::size_t k = 0; k < 5; ++k) {
        const tools::PointRecord& found = nearest.points[5 * i + k];
        CHECK((near_root(found.distance, sorted[k]) && near_root(found.distance, exact.at(found.primitive))));
      }
      CHECK(
          std::ranges::equal(std::as_bytes(std::span(&near, 1)), std::as_bytes(std::span(&nearest.points[5 * i], 1))));
    }
  }
}

TEST_CASE("bvhquery: within and overlaps of spheres have each triangle once, in order") {
  const TempFolder folder;
  Soup soup(752);
  QueryRuns runs(folder, soup.build(folder, "sbvh"));
  const std::vector<float> spheres = soup.queries(checks::trials(1500), 4);
  runs.spheres(spheres);
  const ResultFile within = runs.ask("within"), overlaps = runs.ask("overlaps"), any = runs.ask("any-overlap");
  REQUIRE((within.each == 0 && overlaps.each == 0 && any.each == 1));
  for (std::size_t i = 0; i < within.count; ++i) {
    INFO("sphere " << i << " of seed 752");
    const std::vector<Rational> exact = soup.distances(&spheres[4 * i]);
    const Rational radius(double{spheres[4 * i + 3]});
    std::vector<std::uint32_t> expected, found;
    for (std::uint32_t t = 0; t < exact.size(); ++t)
      if (exact[t] <= radius * radius) expected.push_back(t);
    float last = 0;
    for (std::size_t k = within.first[i]; k < within.first[i + 1]; ++k) {
      CHECK(within.points[k].distance >= last);
      last = within.points[k].distance;
      found.push_back(within.points[k].primitive);
    }
    std::sort(found.begin(), found.end());
    CHECK(found == expected);
    CHECK(overlaps.list(i) == expected);
    if (expected.empty())
      CHECK(any.numbers[i] == kInvalidId);
    else
      CHECK(std::ranges::count(expected, any.numbers[i]) == 1);
  }
}

TEST_CASE("bvhquery: the signed distance from a cube, and its inside") {
  const TempFolder folder;
  const std::string bvh = folder / "cube.bvh";
  check_quiet(run({kBvhBuild, folder.write("cube.obj", kCube), "-o", bvh}));
  QueryRuns runs(folder, bvh);
  Random random(753);
  std::vector<float> points;
  for (unsigned i = 0; i < checks::trials(6000); ++i) {
    const auto p = random.in_cube(2.0);
    points.insert(points.end(), p.begin(), p.end());
  }
  runs.points(points);
  const ResultFile field = runs.ask("signed"), inside = runs.ask("inside");
  for (std::size_t i = 0; i < field.count; ++i) {
    INFO("point " << i << " of seed 753");
    const double expected = from_cube(&points[3 * i]);
    CHECK(std::abs(double{field.points[i].distance} - expected) < 1e-6);
    if (expected != 0) CHECK(inside.numbers[i] == (expected < 0 ? 1u : 0u));
  }
  const ResultFile near = runs.ask("signed", {"--max-distance", "0.125"});
  for (std::size_t i = 0; i < near.count; ++i) {
    const double expected = from_cube(&points[3 * i]);
    const bool found = std::abs(expected) <= 0.125;
    CHECK((near.points[i].primitive != kInvalidId) == found);
    if (!found) CHECK(near.points[i].distance == (expected < 0 ? -kInf : kInf));
  }
}

TEST_CASE("bvhquery: --sign winding finds the inside of a cube without one of its triangles") {
  const TempFolder folder;
  const std::string bvh = folder / "open.bvh", text = kCube, face = "f 4 1 5 8\n";
  const std::string open = text.substr(0, text.size() - face.size()) + "f 4 1 5\n";
  check_quiet(run({kBvhBuild, folder.write("open.obj", open), "-o", bvh}));
  QueryRuns runs(folder, bvh);
  std::vector<float> points;
  for (int row = 0; row < 5; ++row)  // Far from the hole, which is on the left.
    for (int i = 0; i < 100; ++i)
      points.insert(points.end(), {1.3f - 0.008f * static_cast<float>(i), 0.37f, 0.2f * static_cast<float>(row)});
  runs.points(points);
  const ResultFile inside = runs.ask("inside", {"--sign", "winding"}),
                   field = runs.ask("signed", {"--sign", "winding"});
  for (std::size_t i = 0; i < inside.count; ++i) {
    CHECK(inside.numbers[i] == (from_cube(&points[3 * i]) < 0 ? 1u : 0u));
    CHECK(std::signbit(field.points[i].distance) == (from_cube(&points[3 * i]) < 0));
  }
}

TEST_CASE("bvhquery: boxes on a grid overlap the triangles that they touch, exactly") {
  const TempFolder folder;
  const std::string bvh = folder / "grid.bvh";
  check_quiet(run({kBvhBuild, folder.write("a.obj", grid_obj(4)), folder.write("b.obj", grid_obj(1, 2)), "-o", bvh}));
  QueryRuns runs(folder, bvh);
  const float next = std::nextafter(0.0f, 1.0f);
  runs.boxes({0.5f,  0.25f, -1,   0.75f, 0.4f,  1,    // Below the diagonal of the first square.
              0.25f, 0.25f, 0,    0.75f, 0.75f, 3,    // Both of its triangles, and the square above.
              4,     4,     0,    5,     5,     0,    // The last corner of the grid.
              0.5f,  0.25f, next, 0.75f, 0.4f,  1,    // Just above.
              9,     9,     9,    10,    10,    10,   // Far away.
              1,     1,     1,    0,     0,     0});  // No box.
  const ResultFile found = runs.ask("overlaps"), any = runs.ask("any-overlap");
  CHECK(runs.summary["found"] == 3);
  CHECK(found.list(0) == std::vector<std::uint32_t>{0});
  CHECK(found.list(1) == std::vector<std::uint32_t>{0, 1, 32, 33});
  CHECK(found.list(2) == std::vector<std::uint32_t>{30, 31});
  for (const std::size_t none : {3u, 4u, 5u}) {
    CHECK(found.list(none).empty());
    CHECK(any.numbers[none] == kInvalidId);
  }
  CHECK(any.numbers[0] == 0);
}

TEST_CASE("bvhquery: results through instances have paths; primitives are those of the object") {
  const TempFolder folder;
  const std::vector<build::Position> corners{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  const std::vector<build::TriangleMesh> meshes{{corners, triangles}, {corners, triangles}};
  const auto object = build::build(meshes);
  REQUIRE(object.has_value());
  build::Instance low{.object = 0, .id = 7}, high{.object = 0, .id = 9};
  high.to_scene.row[2][3] = 5;
  const std::vector<std::span<const std::byte>> files{object->buffer.bytes()};
  const std::vector<build::Instance> both{low, high};
  const std::vector<std::span<const build::Instance>> groups{both};
  const auto scene = build::build_instances(build::InstancedScene{files, groups});
  REQUIRE(scene.has_value());
  REQUIRE(build::write_file(folder / "i.bvh", scene->buffer.bytes()).has_value());
  QueryRuns runs(folder, folder / "i.bvh");
  const std::string paths = folder / "out.paths";
  runs.points({0.75f, 0.25f, 4, 0.25f, 0.75f, -1, kNan, 0, 0});
  const ResultFile near = runs.ask("nearest", {"-k", "2", "--paths", paths});
  const auto path = [&](std::size_t i) { return tools::read_paths(paths).value().paths.at(i); };
  CHECK((near.points[0].distance == 1 && near.points[0].primitive == 0 && near.points[0].z == 5));
  CHECK((near.points[1].distance == 1 && near.points[1].primitive == 2));  // The same square again: geometry 1.
  CHECK((path(0).instance == 1 && path(0).id == 9 && path(1).id == 9));
  CHECK((near.points[2].distance == 1 && near.points[2].primitive == 1 && path(2).id == 7));
  CHECK((near.points[4].distance == kInf && near.points[4].primitive == kInvalidId && path(4).id == kInvalidId));
  runs.points({0, 0, 0});
  const CommandResult refused = run(runs.command({"--query", "inside", "--sign", "winding"}));
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, Catch::Contains("i.bvh: winding numbers are those of one mesh: this file has instances"));
  runs.boxes({0.7f, 0.2f, -1, 0.8f, 0.3f, 6});
  CHECK(runs.ask("overlaps", {"--paths", paths}).list(0) == std::vector<std::uint32_t>{0, 2, 0, 2});
  CHECK((path(0).id == 7 && path(1).id == 7 && path(2).id == 9 && path(3).id == 9));
}

TEST_CASE("bvhquery: files do not depend on the number of threads; no queries and no triangles are fine") {
  const TempFolder folder;
  Soup soup(754);
  const std::string bvh = soup.build(folder, "sbvh"), out = folder / "out.results";
  QueryRuns runs(folder, bvh);
  runs.spheres(soup.queries(1000, 4));
  for (const std::string query : {"closest", "within", "overlaps", "signed"}) {
    runs.ask(query, {"--threads", "1"});
    const std::string one = read_file(out);
    runs.ask(query, {"--threads", "4"});
    CHECK(read_file(out) == one);
  }
  runs.spheres({});
  for (const std::string query : {"closest", "within", "nearest", "any-overlap"}) CHECK(runs.ask(query).count == 0);
  const std::string none = folder / "none.bvh";
  CHECK(run({kBvhBuild, folder.write("none.obj", "v 0 0 0\n"), "-o", none}).status == 0);
  QueryRuns empty(folder, none);
  empty.points({0, 0, 0});
  CHECK(empty.ask("nearest").points.at(7).primitive == kInvalidId);
  CHECK(empty.ask("inside").numbers == std::vector<std::uint32_t>{0});
}

namespace {

using Walk = std::vector<std::array<float, 4>>;

/// Points with radii, in small and large steps, and back to where they were.
Walk random_walk(Random& random, float offset) {
  Walk walk(600);
  std::array<float, 4> at{offset, 0, 0, 1};
  for (std::size_t i = 0; i < walk.size(); ++i) {
    const auto step = random.in_cube(random.log_uniform(1e-9, 2.0));
    for (std::size_t k = 0; k < 3; ++k) at[k] += i % 50 == 49 ? -10 * step[k] : step[k];
    at[3] = static_cast<float>(random.log_uniform(1e-3, 10));
    walk[i] = i % 97 == 96 ? walk[i / 2] : at;
  }
  return walk;
}

/// @param width 3: points, 4: spheres. @param nearest 0: the closest.
ResultFile ask_walk(QueryRuns& runs, const Walk& walk, unsigned width, unsigned nearest) {
  std::vector<float> values;
  for (const auto& at : walk) values.insert(values.end(), at.begin(), at.begin() + width);
  width == 3 ? runs.points(values) : runs.spheres(values);
  return nearest == 0 ? runs.ask("closest") : runs.ask("nearest", {"-k", std::to_string(nearest)});
}

}  // namespace

TEST_CASE("bvhquery: results do not depend on the order of the queries") {
  constexpr std::uint64_t kSeed = 20271201;
  for (const float offset : {0.0f, 1e6f}) {
    const TempFolder folder;
    Soup soup(kSeed);
    for (auto& p : soup.mesh.positions) p[0] += offset;
    QueryRuns runs(folder, soup.build(folder, "sbvh"));
    const Walk walk = random_walk(soup.random, offset);
    std::vector<std::uint32_t> order(walk.size());
    Walk shuffled(walk.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    for (auto i = static_cast<std::uint32_t>(order.size()); i-- > 1;)
      std::swap(order[i], order[soup.random.below(i + 1)]);
    for (std::size_t i = 0; i < order.size(); ++i) shuffled[i] = walk[order[i]];
    for (const unsigned width : {3u, 4u})
      for (const unsigned nearest : {0u, 1u, 3u, 60u, 100u}) {
        const ResultFile a = ask_walk(runs, walk, width, nearest), b = ask_walk(runs, shuffled, width, nearest);
        INFO("seed " << kSeed << ", offset " << offset << ", width " << width << ", nearest " << nearest);
        const std::size_t bytes = a.each * sizeof(tools::PointRecord);
        for (std::size_t i = 0; i < order.size(); ++i)
          REQUIRE(std::memcmp(&b.points[i * b.each], &a.points[order[i] * a.each], bytes) == 0);
      }
  }
}

TEST_CASE("bvhquery: spheres and curves of files, also in instances") {
  const TempFolder folder;
  const std::string balls = folder.write("balls.xyzr", "0 0 0 1\n6 0 0 2\n0 9 0 0.5\n"), bvh = folder / "balls.bvh";
  check_quiet(run({kBvhBuild, balls, "-o", bvh}));
  QueryRuns runs(folder, bvh);
  // Outside, inside, and at a center.
  runs.points({-3, 0, 0, 5, 0, 0, 0, 9, 0});
  const ResultFile closest = runs.ask("closest");
  const float expected[3][5] = {{2, -1, 0, 0, 0}, {1, 4, 0, 0, 1}, {0.5f, 0, 9, 0.5f, 2}};
  for (std::size_t i = 0; i < 3; ++i) {
    const tools::PointRecord& one = closest.points[i];
    CHECK((one.distance == expected[i][0] && one.x == expected[i][1] && one.y == expected[i][2] &&
           one.z == expected[i][3] && static_cast<float>(one.primitive) == expected[i][4] && one.feature == 0));
  }
  const ResultFile nearest = runs.ask("nearest", {"-k", "2"});
  CHECK((nearest.points[0].primitive == 0 && nearest.points[1].primitive == 1 && nearest.points[1].distance == 7));
  runs.spheres({-3, 0, 0, 7, -3, 0, 0, 1.5f});
  const ResultFile within = runs.ask("within");
  CHECK((within.first == std::vector<std::uint64_t>{0, 2, 2} && within.points[1].distance == 7));
  json_of(run({kBvhQuery, bvh, "--slice", "z", "--query", "closest", "-o", folder / "balls.png", "--json"}));

  folder.write("two.json", R"({"format": "hiprt scene", "version": 1, "scene": "two", "objects": {"a": ["balls.xyzr"]},
    "groups": {"two": [{"object": "a", "translate": [100, 0, 0]}, {"object": "a", "scale": 2}]}})");
  check_quiet(run({kBvhBuild, folder / "two.json", "-o", folder / "two.bvh"}));
  QueryRuns two(folder, folder / "two.bvh");
  two.points({-3, 0, 0, 97, 0, 0});
  const ResultFile placed = two.ask("closest", {"--paths", folder / "two.paths"});
  CHECK((placed.points[0].distance == 1 && placed.points[1].distance == 2));
  const auto paths = tools::read_paths(folder / "two.paths");
  CHECK((paths->paths[0].instance == 1 && paths->paths[1].instance == 0));
}
