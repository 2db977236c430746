/// Spheres and curves through the programs: in scenes, alone, and with invalid input.

#include <tests/tools/importers/hair_files.h>
#include "json_result.h"
#include "programs.h"

#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <tools/scene_io/rays_file.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <utility>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

const std::string kBvhRender = HIPRT_BVHRENDER;

/// A group of a mesh with two spheres and a strand, and of the strands of a file, which moves.
json scene_json() {
  return json::parse(R"({"format": "hiprt scene", "version": 1, "scene": "all",
    "objects": {"mixed": ["grid.obj", {"spheres": [[0, 0, 5, 1], [3, 0, 5, 0.5]]},
                          {"curves": [[[0, 3, 5, 0.5], [3, 3, 5, 0.25]]]}],
                "ball": {"spheres": [[0, 0, 0, 2]]}, "wig": ["wig.hair"]},
    "groups": {"all": [{"object": "mixed"}, {"object": "ball", "translate": [20, 0, 0], "scale": [1, 1, 0.5]},
                       {"object": "wig", "motion": {"keys": [{"time": 0, "translate": [40, 0, 0]},
                                                             {"time": 1, "translate": [44, 0, 0]}]}}]}})");
}

struct Files {
  TempFolder folder;
  std::string scene = folder / "s.json", out = folder / "s.bvh", rays = folder / "r.rays", hits = folder / "r.hits",
              paths = folder / "r.paths", hair = folder / "wig.hair";

  explicit Files(const json& description = scene_json()) {
    folder.write("grid.obj", grid_obj(4));
    folder.write("wig.hair", HairFile{}.bytes());
    folder.write("s.json", description.dump());
  }
  /// Rays down from z = 10 at these points.
  void write_rays(const std::vector<std::pair<float, float>>& points) const {
    std::string bytes;
    append(bytes, static_cast<std::uint32_t>(points.size()), 0u);
    for (const auto& [x, y] : points) append(bytes, x, y, 10.f, 0.f, 0.f, 0.f, -1.f, 1e30f);
    folder.write("r.rays", bytes);
  }
  std::vector<std::pair<float, std::uint32_t>> trace(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> command{kBvhTrace, out, "--rays", rays, "--hits", hits};
    command.insert(command.end(), more.begin(), more.end());
    check_good(run(command));
    const std::string bytes = read_file(hits);
    std::vector<std::pair<float, std::uint32_t>> result(bytes.size() / 8);
    for (std::size_t i = 0; i < result.size(); ++i) {
      std::memcpy(&result[i].first, bytes.data() + 8 * i, 4);
      std::memcpy(&result[i].second, bytes.data() + 8 * i + 4, 4);
    }
    return result;
  }
};

void check_refused(const Files& files, const std::vector<std::string>& command, int status, const std::string& word) {
  const auto names = files.folder.names();
  const CommandResult result = run(command);
  INFO(result.err);
  CHECK(result.status == status);
  CHECK_THAT(result.err, Contains(word));
  CHECK(files.folder.names() == names);
}

}  // namespace

TEST_CASE("Program shapes: a scene of meshes, spheres, curves and hair is built, described and traced") {
  const Files files;
  check_quiet(run({kBvhBuild, files.scene, "-o", files.out}));
  check_good(run({kBvhInfo, files.out, "--validate"}));
  const json info = json_of(run({kBvhInfo, files.out, "--json"}));
  CHECK(info["features"] == json({"triangles", "custom primitives", "instances", "motion", "moving boxes"}));
  CHECK(info["scene"]["customs"]["unique"] == 2 + 1 + 1 + 3);
  CHECK(info["scene"]["triangles"]["unique"] == 32);

  files.write_rays({{0, 0}, {3, 0}, {1.5f, 3}, {1, 1}, {20, 0}, {41.5f, 0.25f}, {40.5f, 0}, {-9, 0}});
  const auto hits = files.trace({"--paths", files.paths});
  REQUIRE(hits.size() == 8);
  // The object's geometries are the mesh of 32 triangles, the spheres and the curves; the middle of the strand's cone
  // has a radius of 0.375, and is a little thicker at right angles to its axis.
  CHECK(hits[0] == std::pair(4.0f, 32u));
  CHECK(hits[1] == std::pair(4.5f, 33u));
  CHECK(hits[2].first == Approx(5 - 0.375 / std::sqrt(1 - 1.0 / 144)));
  CHECK(hits[2].second == 34);
  CHECK(hits[3].first == 10);
  CHECK(hits[3].second < 32);
  CHECK(hits[4] == std::pair(9.0f, 0u));
  CHECK(hits[5].second == 1);
  CHECK(hits[6].second == 0);
  CHECK(hits[7].second == kInvalidId);
  // Half of the time later the wig is 2 farther.
  const auto later = files.trace({"--time", "0.5"});
  CHECK(later[6].second == kInvalidId);
  CHECK(files.trace({"--query", "any"})[0].second != kInvalidId);
  // Which of two triangles with a common edge is hit there is for the triangle test to say.
  const auto exact = files.trace({"--triangle-test", "reference"});
  for (std::size_t i = 0; i < hits.size(); ++i) CHECK(exact[i].first == hits[i].first);
}

TEST_CASE("Program shapes: hair and spheres without a scene, in every layout, beside a mesh") {
  const Files files;
  const std::string atoms = files.folder.write("atoms.xyzr", "0 0 5 1\n3 0 5 0.5\n"), grid = files.folder / "grid.obj";
  files.write_rays({{0, 0}, {1.5f, 0.25f}, {3, 0}, {2, 2}, {9, 9}});
  for (const std::string nodes : {"planes", "float", "half", "quantized"}) {
    INFO(nodes);
    check_quiet(run({kBvhBuild, atoms, files.hair, grid, "-o", files.out, "--nodes", nodes}));
    check_good(run({kBvhInfo, files.out, "--validate"}));
    const auto hits = files.trace();
    CHECK(hits[0] == std::pair(4.0f, 32u));
    CHECK(hits[1].second == 34 + 1);
    CHECK(hits[2] == std::pair(4.5f, 33u));
    CHECK(hits[3].second < 32);
    CHECK(hits[4].second == kInvalidId);
  }
  const json info = json_of(run({kBvhInfo, files.out, "--json"}));
  REQUIRE(info["geometries"].size() == 3);
  CHECK(info["geometries"][1]["shapes"] == "spheres");
  CHECK(info["geometries"][1]["customs"] == 2);
  CHECK(info["geometries"][2]["shapes"] == "curves");
  CHECK(info["geometries"][2]["points"] == 5);
  CHECK_THAT(run({kBvhInfo, files.out}).out, Contains("3 segments of curves of type 1, 5 points, 0 dropped"));
  CHECK_THAT(run({kBvhBuild, files.hair, "-o", files.out, "--stats"}).out, Contains("spheres and segments of curves"));
}

TEST_CASE("Program shapes: --instances, --import and --refit accept files of shapes") {
  const Files files;
  const std::string tree = files.folder / "tree.json", moved = files.folder / "moved.bvh";
  check_quiet(run({kBvhBuild, files.hair, "-o", files.out}));
  check_quiet(run({kBvhInfo, files.out, "--export", tree}));
  check_quiet(run({kBvhBuild, files.hair, "-o", files.out, "--import", tree}));
  HairFile higher;
  for (std::size_t i = 2; i < higher.positions.size(); i += 3) higher.positions[i] += 3;
  const std::string to = files.folder.write("higher.hair", higher.bytes());
  check_good(run({kBvhBuild, files.out, "--refit", to, "-o", moved}));
  check_good(run({kBvhInfo, moved, "--validate"}));
  files.write_rays({{0, 0}, {0.5f, 0}});
  const float before = files.trace()[1].first;
  files.folder.write("s.bvh", read_file(moved));
  CHECK(files.trace()[1].first == Approx(before - 3));
  check_quiet(run({kBvhBuild, files.hair, files.folder / "grid.obj", "--instances", "-o", files.out}));
  CHECK(files.trace()[1].first == Approx(before));
  CHECK(json_of(run({kBvhInfo, files.out, "--json"}))["scene"]["objects"] == 2);
}

TEST_CASE("Program shapes: pictures, heat maps and explanations") {
  const Files files;
  const std::string picture = files.folder / "p.png", layers = files.folder / "p.exr";
  check_quiet(run({kBvhBuild, files.scene, "-o", files.out}));
  for (const std::string mode : {"ao", "normals", "heatmap", "bvh"}) {
    INFO(mode);
    check_good(run({kBvhRender, files.out, "-o", picture, "--mode", mode, "--size", "64x48", "--spp", "2"}));
  }
  check_good(run({kBvhRender, files.out, "-o", layers, "--size", "64x48", "--spp", "2"}));
  files.write_rays({{0, 0}});
  const CommandResult told = run({kBvhTrace, files.out, "--rays", files.rays, "--explain", "0"});
  check_good(told);
  CHECK_THAT(told.out, Contains("0 at t = 4, closest so far"));
  CHECK_THAT(told.out, Contains("hit: geometry 1, primitive 0 in instance 0, t = 4"));
}

TEST_CASE("Program shapes: invalid input is refused with the reason") {
  const Files files;
  check_refused(files, {kBvhBuild, files.scene, "-o", files.out, "--flatten"}, 1, "groups.all[2] moves");
  json still = scene_json();
  still["groups"]["all"].erase(2);
  still["objects"].erase("wig");
  const Files of_still(still);
  check_refused(of_still, {kBvhBuild, of_still.scene, "-o", of_still.out, "--flatten"}, 1,
                "mixed has spheres or curves, which cannot be flattened");
  check_refused(files, {kBvhBuild, files.hair, "-o", files.out, "--device", "gpu"}, 1,
                "spheres and curves are built on the CPU");
  check_refused(files, {kBvhBuild, files.hair, "-o", files.hair}, 1, "wig.hair");
  files.folder.write("cut.hair", HairFile{}.bytes().substr(0, 200));
  check_refused(files, {kBvhBuild, files.folder / "cut.hair", "-o", files.out}, 1,
                "cut.hair: truncated: 200 bytes, its 2 strands and 5 points take 212");
  check_quiet(run({kBvhBuild, files.hair, "-o", files.out}));
  files.write_rays({{0, 0}});
  check_refused(files, {kBvhTrace, files.out, "--rays", files.rays, "--hits", files.hits, "--triangle-test", "fast"}, 1,
                "traced with --triangle-test watertight or reference and --box-test conservative only");
  const CommandResult refit =
      run({kBvhBuild, files.out, "--refit", files.folder / "grid.obj", "-o", files.folder / "x.bvh"});
  CHECK(refit.status == 1);
  CHECK_THAT(refit.err, Contains("geometry 0 of the file to refit is of custom primitives"));
}

TEST_CASE("Program shapes: shapes of radius 0 are dropped, with a warning") {
  const Files files;
  const std::string atoms = files.folder.write("atoms.xyzr", "0 0 5 1\n3 0 5 0\n");
  const CommandResult result = run({kBvhBuild, atoms, "-o", files.out});
  CHECK(result.status == 0);
  CHECK_THAT(result.err, Contains("dropped 1 of 2 primitives") && Contains("a radius of 0"));
}
