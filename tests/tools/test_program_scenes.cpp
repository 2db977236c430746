/// Scenes of instances through bvhbuild and bvhinfo.

#include <tests/tools/importers/gltf_builder.h>
#include "json_result.h"
#include "programs.h"
#include "scene_file.h"

#include <hiprt_build/file.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_device/hiprt_device.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

constexpr unsigned kMostLevels = 4;
using SceneTracer = Instanced<Policies, kMostLevels>;
using FlatTracer = Policies;

/// A grid of 4 x 4 and one of 2 x 2; three groups, one of them inside both others; a mirror and masks.
json forest() {
  return json::parse(R"({"format": "hiprt scene", "version": 1,
    "objects": {"big": ["big.obj"], "both": ["big.obj", "small.obj"], "again": ["./big.obj"]},
    "groups": {
      "low": [{"object": "big", "scale": [0.5, 1, -1]},
              {"object": "both", "translate": [0, 5, 1], "rotate": {"axis": [1, 1, 0], "degrees": 30}, "mask": 4}],
      "middle": [{"object": "low"}, {"object": "low", "translate": [6, 0, 0], "rotate": [0, 0.6, 0, 0.8]}],
      "top": [{"object": "middle", "scale": 0.7, "id": 3}, {"object": "low", "translate": [0, -6, 2]},
              {"object": "again", "translate": [-5, 0, 0.25], "mask": 3, "id": 5}]},
    "scene": "top"})");
}

struct Files {
  TempFolder folder;
  std::string scene = folder / "s.json", out = folder / "s.bvh", flat = folder / "f.bvh";

  explicit Files(const json& description = forest()) {
    folder.write("big.obj", grid_obj(4));
    folder.write("small.obj", grid_obj(2, 1));
    folder.write("s.json", description.dump());
  }
};

/// Bytes, and their view if they are valid.
struct OpenFile {
  build::Buffer buffer;
  BufferView view;

  explicit OpenFile(const std::string& path) : buffer(std::move(*build::map_file(path))) {
    const auto valid = validate(std::as_const(buffer).bytes());
    INFO((valid ? std::string() : to_string(valid.error())));
    REQUIRE(valid);
    view = *open_buffer(std::as_const(buffer).bytes());
  }
};

/// Rays from above meet the same surface in both files.
void check_same_hits(const std::string& instanced, const std::string& flat) {
  const OpenFile a(instanced), b(flat);
  const SceneView scene = make_scene_view(a.view), plain = make_scene_view(b.view);
  REQUIRE(covers<SceneTracer>(scene));
  unsigned hits = 0;
  for (unsigned i = 0; i < 4096; ++i) {
    const unsigned column = i % 64, row = i / 64;
    Ray ray{.origin = {-8.0f + 0.251f * static_cast<float>(column), -8.0f + 0.253f * static_cast<float>(row), 20},
            .direction = {0.05f, 0.03f, -1}};
    ray.mask = i % 3 == 0 ? 4u : i % 3 == 1 ? 1u : 0xffffffffu;
    const auto one = closest_hit<SceneTracer>(scene, ray);
    const Hit other = closest_hit<FlatTracer>(plain, ray);
    INFO(i);
    REQUIRE(one.found() == other.found());
    if (!one.found()) continue;
    ++hits;
    REQUIRE(one.t == Approx(other.t).epsilon(1e-6));
  }
  CHECK(hits > 500);
}

void check_failure(const Files& files, const std::vector<std::string>& more, int status, const std::string& word) {
  const auto names = files.folder.names();
  std::vector<std::string> command{kBvhBuild, files.scene, "-o", files.out};
  command.insert(command.end(), more.begin(), more.end());
  const CommandResult result = run(command);
  INFO(result.err);
  CHECK(result.status == status);
  CHECK_THAT(result.err, Contains(word));
  CHECK(std::count(result.err.begin(), result.err.end(), '\n') == 1);
  CHECK(files.folder.names() == names);
}

}  // namespace

TEST_CASE("Program scenes: rays have the hits of the flattened scene, with all bounds and builders") {
  const Files files;
  check_quiet(run({kBvhBuild, files.scene, "--flatten", "-o", files.flat}));
  for (const std::string bounds : {"root", "children", "grandchildren", "primitives"}) {
    INFO(bounds);
    check_quiet(run({kBvhBuild, files.scene, "-o", files.out, "--instance-bounds", bounds, "--threads", "3"}));
    check_same_hits(files.out, files.flat);
  }
  check_quiet(run({kBvhBuild, files.scene, "-o", files.out, "--quality", "high"}));
  check_same_hits(files.out, files.flat);
}

TEST_CASE("Program scenes: the file does not depend on the number of threads") {
  const Files files;
  check_quiet(run({kBvhBuild, files.scene, "-o", files.out, "--threads", "1"}));
  check_quiet(run({kBvhBuild, files.scene, "-o", files.flat, "--threads", "4"}));
  CHECK(read_file(files.out) == read_file(files.flat));
}

TEST_CASE("Program scenes: bvhbuild and bvhinfo count stored and instantiated triangles") {
  const Files files;
  const json built = json_of(run({kBvhBuild, files.scene, "-o", files.out, "--json"}));
  const json info = json_of(run({kBvhInfo, files.out, "--json"}));
  const json& scene = info["scene"];
  CHECK(built["scene"] == scene);
  CHECK(built["shared_objects"] == 1);
  CHECK(built["mesh_files"] == 2);
  CHECK(built["triangles"] == 32 + 40);
  CHECK(info["triangles"] == 0);
  CHECK(scene["objects"] == 2);
  CHECK(scene["groups"] == 3);
  // low: 32 + 40 triangles of 2 objects; middle: two of it; top: middle, low and again.
  CHECK(
      scene["instances"] ==
      json::parse(R"({"records": 7, "dropped": 0, "opened": 0, "moving": 0, "motion_segments": 0, "of_objects": 7})"));
  CHECK(scene["triangles"] == json::parse(R"({"unique": 72, "instantiated": 248})"));
  CHECK(scene["customs"] == json::parse(R"({"unique": 0, "instantiated": 0})"));
  CHECK(scene["levels"] == json::parse(R"([{"instances": 3, "groups": 2, "objects": 1},
                                           {"instances": 4, "groups": 1, "objects": 2},
                                           {"instances": 4, "groups": 0, "objects": 2}])"));
  const json& bytes = scene["bytes"];
  CHECK(bytes["top"].get<std::size_t>() + bytes["groups"].get<std::size_t>() + bytes["objects"].get<std::size_t>() ==
        read_file(files.out).size());
  const CommandResult text = run({kBvhInfo, files.out});
  CHECK(text.status == 0);
  CHECK_THAT(text.out, Contains("248 in instances, 72 in objects") && Contains("level 3") &&
                           Contains("bytes of groups' trees") && Contains("3 instances, 0 dropped"));
  CHECK_THAT(run({kBvhBuild, files.scene, "-o", files.out, "--stats"}).out,
             Contains("level 3") && Contains("objects named twice"));
  const CommandResult dump = run({kBvhInfo, files.out, "--dump"});
  CHECK(dump.status == 0);
  CHECK_THAT(dump.out, Contains("\ninstance 2 @") && !Contains("\ninstance 3 @") && Contains("\n  to object ("));
  const json flat = json_of(run({kBvhBuild, files.scene, "-o", files.flat, "--flatten", "--json"}));
  CHECK(flat["triangles"] == 248);
  CHECK(flat["geometries"] == 10);
}

TEST_CASE("Program scenes: --levels merges levels, and all surfaces keep their positions") {
  const Files files;
  check_quiet(run({kBvhBuild, files.scene, "--flatten", "-o", files.flat}));
  const auto levels = [&](const std::string& number) {
    check_quiet(run({kBvhBuild, files.scene, "-o", files.out, "--levels", number, "--quality", "high"}));
    check_same_hits(files.out, files.flat);
    const json scene = json_of(run({kBvhInfo, files.out, "--json", "--validate"}))["scene"];
    CHECK(scene["triangles"] == json::parse(R"({"unique": 72, "instantiated": 248})"));
    return scene["levels"];
  };
  CHECK(levels("1") == json::parse(R"([{"instances": 7, "groups": 0, "objects": 2}])"));
  const OpenFile merged(files.out);
  CHECK((merged.view.instances[0].id == 3 && merged.view.instances[3].id == 3 && merged.view.instances[6].id == 5));
  CHECK(levels("2") == json::parse(R"([{"instances": 4, "groups": 1, "objects": 1},
                                       {"instances": 6, "groups": 0, "objects": 2}])"));
  const auto as_described = read_file((check_quiet(run({kBvhBuild, files.scene, "-o", files.flat})), files.flat));
  check_quiet(run({kBvhBuild, files.scene, "-o", files.out, "--levels", "3"}));
  CHECK(read_file(files.out) == as_described);
}

TEST_CASE("Program scenes: --levels reports instances that stay, and products without an inverse") {
  json moving = forest();
  moving["groups"]["top"][0] =
      json::parse(R"({"object": "middle", "motion": {"keys": [{"time": 0}, {"time": 1, "translate": [1, 0, 0]}]}})");
  const Files files(moving);
  const CommandResult built = run({kBvhBuild, files.scene, "-o", files.out, "--levels", "1"});
  CHECK(built.status == 0);
  CHECK_THAT(built.err,
             Contains("s.json: 2 levels are left; instances of groups that stay: 1 for motion, 0 for masks"));
  json tiny = forest();
  tiny["groups"]["middle"][1]["scale"] = 1e-25;
  tiny["groups"]["low"][1]["scale"] = 1e-25;
  check_failure(Files(tiny), {"--levels", "1"}, 1,
                "s.json: groups.top[0][1][1]: the transform has no inverse that floats can hold: determinant 0");
  check_failure(files, {"--levels", "0"}, 2, "--levels");
  check_failure(files, {"--levels", "1", "--flatten"}, 2, "excludes");
}

/// Groups nested 60 deep, with two instances of the next group each.
json doubled_often() {
  json description = forest();
  description["objects"] = {{"big", {"big.obj"}}};
  description["groups"] = {{"g0", {{{"object", "big"}}}}};
  for (unsigned i = 1; i <= 60; ++i) {
    const json half = {{"object", "g" + std::to_string(i - 1)}};
    description["groups"]["g" + std::to_string(i)] = {half, half};
  }
  description["scene"] = "g60";
  return description;
}

TEST_CASE("Program scenes: counts that exceed 64 bits") {
  const Files files(doubled_often());
  check_failure(files, {"--levels", "1"}, 1,
                "s.json: merged, the groups have 1152921504606846976 instances or more, the limit is 134217728");
  const json scene = json_of(run({kBvhBuild, files.scene, "-o", files.out, "--json"}))["scene"];
  CHECK(scene["instances"]["of_objects"] == std::uint64_t{1} << 60);
  CHECK(scene["triangles"]["instantiated"].is_null());
  CHECK(scene["levels"].size() == 61);
  CHECK_THAT(run({kBvhInfo, files.out}).out, Contains("more than 18446744073709551615 in instances"));
}

TEST_CASE("Program scenes: empty objects and groups are dropped") {
  json description = forest();
  description["objects"]["none"] = {"none.obj"};
  description["groups"]["empty"] = json::array();
  description["groups"]["low"].push_back({{"object", "none"}});
  description["groups"]["low"].push_back({{"object", "empty"}});
  const Files files(description);
  files.folder.write("none.obj", "v 0 0 0\n");
  const CommandResult built = run({kBvhBuild, files.scene, "-o", files.out});
  CHECK(built.status == 0);
  CHECK_THAT(built.err, Contains("none.obj: no triangles"));
  const json scene = json_of(run({kBvhInfo, files.out, "--json", "--validate"}))["scene"];
  CHECK(scene["instances"]["dropped"] == 2);
  CHECK(scene["triangles"]["instantiated"] == 248);
}

TEST_CASE("Program scenes: a .scene file gives the same scene as JSON") {
  const TempFolder folder;
  const std::string scene = folder.write(
      "a.scene", SceneFile().triangle(0).triangle(1).group({{0, 1}, {1, 2}}).group({{2, 0}, {2, 4}}).bytes());
  const std::string out = folder / "s.bvh", flat = folder / "f.bvh";
  check_quiet(run({kBvhBuild, scene, "-o", out}));
  check_quiet(run({kBvhBuild, scene, "-o", flat, "--flatten"}));
  const json figures = json_of(run({kBvhInfo, out, "--json", "--validate"}))["scene"];
  CHECK(figures["triangles"] == json::parse(R"({"unique": 2, "instantiated": 4})"));
  const OpenFile a(out), b(flat);
  const Ray ray{.origin = {6.25f, 0.25f, 5}, .direction = {0, 0, -1}};
  const auto hit = closest_hit<SceneTracer>(make_scene_view(a.view), ray);
  CHECK(hit.t == 4);
  CHECK(hit.path.depth == 2);
  CHECK(hit.path.instance[0] == 1);
  CHECK(hit.path.instance[1] == 1);
  const Hit other = closest_hit<FlatTracer>(make_scene_view(b.view), ray);
  CHECK(other.t == 4);
  CHECK(other.geometry == 3);
}

TEST_CASE("Program scenes: --instances makes objects of glTF's meshes") {
  const TempFolder folder;
  GltfBuilder b;
  b.add_mesh(b.add_positions({0, 0, 3, 4, 0, 3, 0, 4, 3}));
  b.json["nodes"] = {{{"mesh", 0}, {"children", {1}}}, {{"mesh", 0}, {"translation", {10, 0, 0}}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  const std::string gltf = folder.write("a.glb", b.glb()), obj = folder.write("b.obj", grid_obj(4));
  const std::string out = folder / "s.bvh", flat = folder / "f.bvh", plain = folder / "p.bvh";
  check_quiet(run({kBvhBuild, gltf, obj, "-o", out, "--instances"}));
  check_quiet(run({kBvhBuild, gltf, obj, "-o", flat, "--instances", "--flatten"}));
  const json scene = json_of(run({kBvhInfo, out, "--json", "--validate"}))["scene"];
  CHECK(scene["objects"] == 2);
  CHECK(scene["triangles"] == json::parse(R"({"unique": 33, "instantiated": 34})"));
  CHECK(json_of(run({kBvhBuild, gltf, obj, "-o", plain, "--json"}))["geometries"] == 2);
  CHECK(json_of(run({kBvhInfo, flat, "--json"}))["geometries"].size() == 3);
  const OpenFile file(out);
  const auto hit =
      closest_hit<SceneTracer>(make_scene_view(file.view), Ray{.origin = {11, 1, 9}, .direction = {0, 0, -1}});
  CHECK(hit.t == 6);
  CHECK(file.view.instances[hit.path.instance[0]].id == 1);
}

TEST_CASE("Program scenes: an instance without an inverse becomes a separate object, with a warning") {
  json description = forest();
  const auto build = [&](const std::vector<double>& scale) {
    description["groups"]["middle"][1]["scale"] = scale;
    const Files files(description);
    const CommandResult built = run({kBvhBuild, files.scene, "-o", files.out});
    CHECK(built.status == 0);
    CHECK_THAT(built.err, Contains("instances without inverse: 1, the first is groups.middle[1]; 72 triangles"));
    CHECK(run({kBvhBuild, files.scene, "-o", files.flat, "--flatten"}).status == 0);
    check_same_hits(files.out, files.flat);
  };
  build({1, 1, 0});
  build({1, 0, 1});
  build({1, 1, 1e-25});
  // A flat transform would not keep spheres spheres.
  const Files shapes(json::parse(R"({"format": "hiprt scene", "version": 1, "objects": {"ball": ["ball.xyzr"]},
    "groups": {"top": [{"object": "ball", "scale": [1, 0, 1]}]}, "scene": "top"})"));
  shapes.folder.write("ball.xyzr", "0 0 0 1\n");
  check_failure(shapes, {}, 1,
                "s.json: groups.top[0]: the transform has no inverse that floats can hold: determinant 0");
}

TEST_CASE("Program scenes: errors are reported with their position, and nothing is written") {
  const auto fails = [](const std::string& pointer, const json& value, const std::string& word) {
    json description = forest();
    description[json::json_pointer(pointer)] = value;
    const Files wrong(description);
    INFO(pointer);
    check_failure(wrong, {}, 1, word);
  };
  fails("/objects/both/1", "nowhere.obj", "nowhere.obj");
  fails("/objects/both/1", "s.json", "s.json: unknown mesh format");
  fails("/groups/top/0/objekt", "low", "s.json: groups.top[0]: unknown key 'objekt'");
  json masks = forest();
  masks["groups"]["middle"][0]["mask"] = 12;
  masks["groups"]["low"][1]["mask"] = 6;
  check_failure(Files(masks), {"--flatten"}, 1, "s.json: groups.low[1].mask: 6 below an instance of mask 12");
  const Files outputs;
  const CommandResult own = run({kBvhBuild, outputs.scene, "-o", outputs.folder / "small.obj"});
  CHECK(own.status == 1);
  CHECK_THAT(own.err, Contains("one of the inputs"));
}

TEST_CASE("Program scenes: a scene is not refitted") {
  const Files files;
  check_quiet(run({kBvhBuild, files.scene, "-o", files.out}));
  const CommandResult result =
      run({kBvhBuild, files.out, "--refit", files.folder / "big.obj", "-o", files.folder / "r.bvh"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Contains("s.bvh: is a scene of instances"));
}

TEST_CASE("Program scenes: options that make no sense are refused") {
  const Files files;
  check_failure(files, {"big.obj"}, 2, "is a scene, which has to be the only INPUT; there are 2");
  check_failure(files, {"--instances"}, 2, "is a scene, which --instances does not take");
  check_failure(files, {"--instance-bounds", "tight"}, 2, "tight");
  check_failure(files, {"--instance-bounds", "root", "--flatten"}, 2, "excludes");
  check_failure(files, {"--import", "tree.json"}, 2, "--import takes meshes");
  for (const char* option : {"--flatten", "--instance-bounds=root", "--levels=1"}) {
    const CommandResult result = run({kBvhBuild, files.folder / "big.obj", "-o", files.out, option});
    CHECK(result.status == 2);
    CHECK_THAT(result.err, Contains("takes a scene of instances"));
  }
}
