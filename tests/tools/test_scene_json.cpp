/// Scenes as JSON: reading them, and the error messages.

#include "load.h"
#include "temp_folder.h"

#include <tools/scene_io/scene/scene_json.h>

#include <tests/catch.h>
#include <nlohmann/json.hpp>

using namespace hiprt;
using namespace hiprt::test;
using nlohmann::json;
using tools::SceneDescription;

namespace {

const char* const kForest = R"({
  "$schema": "scene.schema.json", "format": "hiprt scene", "version": 1,
  "objects": {"trunk": ["trunk.obj"], "tree": ["sub/../trunk.obj", "leaves.ply"], "house": ["./trunk.obj"]},
  "groups": {
    "forest": [{"object": "grove", "mask": 6, "id": 4294967295}, {"object": "house", "translate": [1, 2, 3]}],
    "grove": [{"object": "tree", "matrix": [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]}, {"object": "trunk"}]
  },
  "scene": "forest"})";

SceneDescription read(const std::string& text) {
  const TempFolder folder;
  auto scene = tools::read_scene_json(folder.write("scene.json", text));
  if (!scene) FAIL(scene.error().message);
  return std::move(*scene);
}

/// The error message after the file's path.
std::string fault(const std::string& text) {
  const TempFolder folder;
  const std::string path = folder.write("scene.json", text);
  const auto scene = tools::read_scene_json(path);
  if (scene) FAIL("accepted: " + text);
  CHECK(scene.error().code == build::ErrorCode::kInvalidInput);
  REQUIRE(scene.error().message.starts_with(path + ": "));
  return scene.error().message.substr(path.size() + 2);
}

/// The forest with another value at a JSON pointer.
std::string fault_with(const std::string& pointer, const json& value) {
  json document = json::parse(kForest);
  document[json::json_pointer(pointer)] = value;
  INFO(pointer << " = " << value);
  return fault(document.dump());
}

std::string fault_without(const std::string& pointer, const std::string& key) {
  json document = json::parse(kForest);
  document[json::json_pointer(pointer)].erase(key);
  return fault(document.dump());
}

/// The only instance of a scene, with these keys.
build::Affine affine_of(const std::string& keys) {
  const auto scene = read(R"({"format": "hiprt scene", "version": 1, "objects": {"a": ["a.obj"]}, "scene": "g",
    "groups": {"g": [{"object": "a", )" +
                          keys + "}]}}");
  return scene.groups.at(0).instances.at(0).to_scene;
}

void check_rows(const build::Affine& got, const std::array<double, 12>& expected) {
  for (std::size_t i = 0; i < 12; ++i) {
    INFO(i);
    CHECK(got.row[i / 4][i % 4] == Approx(expected[i]).margin(1e-7));
  }
}

}  // namespace

TEST_CASE("Scene JSON: objects, groups in build order, masks, ids, and each file once") {
  const SceneDescription scene = read(kForest);
  REQUIRE(scene.files.size() == 2);
  CHECK(scene.files[0].ends_with("/trunk.obj"));
  CHECK(scene.files[1].ends_with("/leaves.ply"));
  REQUIRE(scene.objects.size() == 2);
  CHECK(scene.objects[0].meshes == std::vector<std::size_t>{0});
  CHECK(scene.objects[1].meshes == std::vector<std::size_t>{0, 1});
  CHECK(scene.shared_objects == 1);
  REQUIRE(scene.groups.size() == 2);
  CHECK(scene.groups[0].location == "groups.grove");
  CHECK(scene.groups[1].location == "groups.forest");
  const auto &grove = scene.groups[0].instances, &forest = scene.groups[1].instances;
  REQUIRE((grove.size() == 2 && forest.size() == 2));
  CHECK(grove[0].object == 1);
  CHECK(grove[1].object == 0);
  CHECK(forest[0].object == 2);
  CHECK(forest[1].object == 0);
  CHECK(forest[0].mask == 6);
  CHECK(forest[0].id == 0xffffffffu);
  CHECK(forest[1].mask == 0xffffffffu);
  CHECK(forest[1].id == 0);
  check_rows(grove[0].to_scene, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  check_rows(forest[1].to_scene, {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3});
}

TEST_CASE("Scene JSON: scale comes first, then rotation, then translation") {
  check_rows(affine_of(R"("scale": 2)"), {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0});
  check_rows(affine_of(R"("scale": [2, 3, -4])"), {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, -4, 0});
  check_rows(affine_of(R"("rotate": {"axis": [0, 0, 9], "degrees": 90})"), {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0});
  check_rows(affine_of(R"("rotate": {"axis": [1, 0, 0], "degrees": -630})"), {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0});
  check_rows(affine_of(R"("rotate": [0, 0, 0.7071, 0.7071], "scale": [2, 3, 4], "translate": [5, 6, 7])"),
             {0, -3, 0, 5, 2, 0, 0, 6, 0, 0, 4, 7});
}

TEST_CASE("Scene JSON: errors are reported with their position") {
  CHECK(fault_with("/groups/grove/0/matrix", json::array({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11})) ==
        "groups.grove[0].matrix: 11 numbers, 12 expected");
  CHECK(fault_with("/groups/grove/0/matrix/4", "x") == "groups.grove[0].matrix[4]: \"x\", a number expected");
  CHECK(fault_with("/groups/grove/0/matrix/4", 1e39) ==
        "groups.grove[0]: its transform has numbers that single precision cannot hold");
  CHECK(fault_with("/groups/grove/0/scale", 2) == "groups.grove[0]: has both 'matrix' and 'scale'");
  CHECK(fault_with("/groups/forest/1/translate", json::array({1, 2})) ==
        "groups.forest[1].translate: 2 numbers, 3 expected");
  CHECK(fault_with("/groups/forest/1/scale", "big") == "groups.forest[1].scale: \"big\", an array expected");
  CHECK(fault_with("/groups/forest/1/rotate", json::array({1, 1, 0, 0})) ==
        "groups.forest[1].rotate: rotation has the length 1.414214, which may differ from 1 by 0.001 at most");
  CHECK(fault_with("/groups/forest/1/rotate", {{"axis", {0, 0, 0}}, {"degrees", 5}}) ==
        "groups.forest[1].rotate.axis: its length is 0.0");
  CHECK(fault_with("/groups/forest/1/rotate", {{"axis", {0, 0, 1}}}) ==
        "groups.forest[1].rotate: 'degrees' is missing");
  CHECK(fault_with("/groups/forest/1/mask", -1) ==
        "groups.forest[1].mask: -1, an integer from 0 to 4294967295 expected");
  CHECK(fault_with("/groups/forest/1/id", 4294967296) ==
        "groups.forest[1].id: 4294967296, an integer from 0 to 4294967295 expected");
  CHECK(fault_with("/groups/forest/1/color", 1) == "groups.forest[1]: unknown key 'color'");
  CHECK(fault_with("/groups/forest/1", 1) == "groups.forest[1]: 1, an object expected");
  CHECK(fault_with("/groups/forest", json::object()) == "groups.forest: an object, an array expected");
  CHECK(fault_with("/groups/a b", json::array()) == "groups[\"a b\"]: no instance in the scene is of it");
  CHECK(fault_with("/groups/trunk", json::array()) == "groups.trunk: there is an object of that name");
  CHECK(fault_with("/groups/", json::array()) == "groups[\"\"]: a name is empty");
  CHECK(fault_with("/objects/house", "a.obj") == "objects.house: \"a.obj\", an array expected");
  CHECK(fault_with("/objects/house", json::array()) == "objects.house: 0 files or shapes, 1 or more expected");
  CHECK(fault_with("/objects/house/0", 5) ==
        "objects.house[0]: a path, or an object with 'spheres' or 'curves' expected");
  CHECK(fault_with("/objects/spare", {"a.obj"}) == "objects.spare: no instance in the scene is of it");
  CHECK(fault_with("/scene", "none") == "scene: 'none' is neither an object nor a group");
  CHECK(fault_with("/scene", "tree") == "scene: 'tree' is an object, a group expected");
  CHECK(fault_with("/scene", 1) == "scene: 1, a string expected");
  CHECK(fault_with("/format", "other") == "format: 'other', 'hiprt scene' expected");
  CHECK(fault_with("/version", 2) == "version: 2, known is 1");
  CHECK(fault_with("/extra", 2) == "the document: unknown key 'extra'");
  CHECK(fault_without("", "scene") == "the document: 'scene' is missing");
  CHECK(fault_without("/groups/forest/1", "object") == "groups.forest[1]: 'object' is missing");
  CHECK(fault("[]") == "the document: an array, an object expected");
}

TEST_CASE("Scene JSON: a group that contains itself is refused, also through other groups") {
  CHECK(fault_with("/groups/grove/1/object", "grove") == "groups.grove[1].object: a cycle: 'grove' has 'grove'");
  CHECK(fault_with("/groups/grove/1/object", "forest") ==
        "groups.grove[1].object: a cycle: 'forest' has 'grove' has 'forest'");
}

TEST_CASE("Scene JSON: text that is not valid JSON is refused") {
  CHECK(contains(fault("{"), "parse error"));
  CHECK(contains(fault(std::string(100000, '[')), "deeper than 9 levels"));
  CHECK(fault(R"({"scene": "a", "scene": "b"})") == "an object has the key \"scene\" twice");
  CHECK(contains(fault("{\"scene\": \"\xff\"}"), "UTF-8"));
  CHECK(contains(fault(R"({"version": 1e999})"), "number overflow"));
  CHECK(read("\xef\xbb\xbf" + std::string(kForest)).groups.size() == 2);
  CHECK(tools::read_scene_json("/none/scene.json").error().code == build::ErrorCode::kIo);
}

TEST_CASE("Scene JSON: many levels") {
  json document = json::parse(kForest);
  document["objects"] = {{"a", {"a.obj"}}};
  document["groups"] = {{"g0", {{{"object", "a"}}}}};
  constexpr unsigned kLevels = 20000;
  for (unsigned i = 1; i < kLevels; ++i)
    document["groups"]["g" + std::to_string(i)] = {{{"object", "g" + std::to_string(i - 1)}}};
  document["scene"] = "g" + std::to_string(kLevels - 1);
  const SceneDescription scene = read(document.dump());
  REQUIRE(scene.groups.size() == kLevels);
  for (unsigned i = 0; i < kLevels; ++i) REQUIRE(scene.groups[i].instances[0].object == i);
}

TEST_CASE("Scene JSON: spheres, curves and files of shapes") {
  json document = json::parse(kForest);
  document["objects"]["tree"] = {
      "a.ply", {{"spheres", {{1, 2, 3, 0.5}}}}, "sub/wig.hair", {{"curves", {{{0, 0, 0, 1}, {1, 0, 0, 0}}}}}};
  document["objects"]["house"] = {
      {"curves", {{{0, 0, 0, 1}, {1, 0, 0, 0}, {2, 0, 0, 1}}, {{0, 0, 0, 1}, {1, 0, 0, 2}}}}};
  document["objects"]["trunk"] = {"./sub/../sub/wig.hair"};
  const SceneDescription scene = read(document.dump());
  REQUIRE(scene.shapes.size() == 4);
  REQUIRE(scene.objects.size() == 3);
  CHECK(scene.objects[0].shapes == std::vector<std::size_t>{0});
  CHECK(scene.shapes[0].name == "objects.house");
  CHECK(scene.shapes[0].kind == ShapeKind::kCurves);
  CHECK(scene.shapes[0].strands == 2);
  CHECK(scene.shapes[0].segments == std::vector<std::uint32_t>{0, 1, 3});
  CHECK(scene.shapes[0].points[4].radius == 2);
  CHECK(scene.objects[1].meshes == std::vector<std::size_t>{0});
  CHECK(scene.objects[1].shapes == std::vector<std::size_t>{1, 2, 3});
  CHECK(scene.shapes[1].kind == ShapeKind::kSpheres);
  CHECK(scene.shapes[1].name == "objects.tree[1]");
  CHECK(scene.shapes[2].path.ends_with("/sub/wig.hair"));
  CHECK(scene.objects[2].shapes == std::vector<std::size_t>{2});
  CHECK(scene.files.size() == 1);
}

TEST_CASE("Scene JSON: invalid shapes are refused with their position") {
  const auto with = [](const std::string& text) { return fault_with("/objects/tree", json::parse(text)); };
  CHECK(with(R"({"curves": [[[0,0,0,1],[1,0,0,1]], [[0,0,0,1],[1,0,0,1]], [[-1,0,0,-1],[0,0,0,1]]]})") ==
        "objects.tree.curves[2][0]: radius -1");
  CHECK(with(R"(["a.obj", {"spheres": [[0, 0, 0, 1], [0, 1e39, 0, 1]]}])") == "objects.tree[1].spheres[1]: y is inf");
  CHECK(with(R"({"spheres": [[0, 0, 0]]})") == "objects.tree.spheres[0]: 3 numbers, 4 expected");
  CHECK(with(R"({"spheres": []})") == "objects.tree.spheres: 0 spheres, 1 or more expected");
  CHECK(with(R"({"curves": []})") == "objects.tree.curves: 0 strands, 1 or more expected");
  CHECK(with(R"({"curves": [[[0, 0, 0, 1]]]})") == "objects.tree.curves[0]: 1 points, 2 or more expected");
  CHECK(with(R"({"curves": [[[0, 0, 0, 1], 7]]})") == "objects.tree.curves[0][1]: 7, an array expected");
  CHECK(with(R"({"cones": []})") == "objects.tree: unknown key 'cones'");
  CHECK(with(R"({"curves": [], "spheres": []})") == "objects.tree: either 'spheres' or 'curves' expected");
  CHECK(with(R"({})") == "objects.tree: 0 files or shapes, 1 or more expected");
  CHECK(with(R"([{}])") == "objects.tree[0]: either 'spheres' or 'curves' expected");
  CHECK(with(R"([7])") == "objects.tree[0]: a path, or an object with 'spheres' or 'curves' expected");
}
