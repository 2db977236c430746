/// Scenes in the binary format: reading them, skipped parts, and the error messages.

#include "load.h"
#include "scene_file.h"

#include <tools/scene_io/scene/scene_binary.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::test;

namespace {

tools::SceneDescription read(const std::string& bytes) {
  const TempFolder folder;
  auto scene = tools::read_scene_binary(folder.write("a.scene", bytes));
  if (!scene) FAIL(scene.error().message);
  return std::move(*scene);
}

std::string fault(const std::string& bytes) {
  const TempFolder folder;
  const std::string path = folder.write("a.scene", bytes);
  const auto scene = tools::read_scene_binary(path);
  if (scene) FAIL("accepted");
  CHECK(scene.error().code == build::ErrorCode::kInvalidInput);
  REQUIRE(scene.error().message.starts_with(path + ": "));
  return scene.error().message.substr(path.size() + 2);
}

}  // namespace

TEST_CASE("Scene binary: meshes and groups are numbered separately, and unused objects are skipped") {
  const auto scene = read(SceneFile()
                              .triangle(0)                      // 0
                              .triangle(1)                      // 1: not used
                              .group({{0, 1}, {0, 2}})          // 2
                              .triangle(3)                      // 3
                              .group({{3, 5}})                  // 4: not used
                              .group({{3, 7}, {2, 8}, {2, 9}})  // 5
                              .bytes());
  REQUIRE(scene.meshes.size() == 2);
  CHECK(scene.meshes[0].name == "object 0");
  CHECK(scene.meshes[1].name == "object 3");
  CHECK(scene.meshes[1].positions == Positions{{0, 0, 3}, {1, 0, 3}, {0, 1, 3}});
  CHECK(scene.meshes[1].triangles == Triangles{{0, 1, 2}});
  REQUIRE(scene.objects.size() == 2);
  CHECK(scene.objects[1].meshes == std::vector<std::size_t>{1});
  REQUIRE(scene.groups.size() == 2);
  CHECK(scene.groups[0].location == "objects[2]");
  CHECK(scene.groups[1].location == "objects[5]");
  const auto& top = scene.groups[1].instances;
  REQUIRE(top.size() == 3);
  CHECK(top[0].object == 1);
  CHECK(top[1].object == 2);
  CHECK(top[2].object == 2);
  CHECK(top[2].id == 2);
  CHECK(top[2].to_scene.row[0][3] == 9);
  CHECK(top[2].to_scene.row[1][1] == 1);
}

TEST_CASE("Scene binary: a scene that is only a mesh has one instance") {
  const auto scene = read(SceneFile().triangle(0).triangle(4).bytes());
  REQUIRE(scene.groups.size() == 1);
  REQUIRE(scene.objects.size() == 1);
  CHECK(scene.groups[0].instances.size() == 1);
  CHECK(scene.meshes[0].positions[0] == build::Position{0, 0, 4});
}

TEST_CASE("Scene binary: errors are reported with the object") {
  const std::string good = SceneFile().triangle(0).group({{0, 1}}).bytes();
  CHECK(contains(fault("SCN2" + good.substr(4)), "not a .scene file"));
  CHECK(contains(fault("SCN"), "not a .scene file"));
  CHECK(fault(SceneFile().bytes()) == "0 objects, 1 or more expected");
  CHECK(fault(good + "1234") == "4 bytes are left behind the last object");
  CHECK(fault(SceneFile().triangle(0).group({{1, 1}}).bytes()) ==
        "object 1, child 0: object 1, those before the group are 1");
  std::string kind = good;
  kind[8] = 9;
  CHECK(fault(kind) == "object 0: kind 9, known are 0 (mesh) and 1 (group)");
  std::string vertex = good;
  vertex[8 + 12 + 36] = 7;
  CHECK(fault(vertex) == "object 0, triangle 0: vertex 7, but only 3 vertices are there");
  // Numbers whose product has more than 32 bits.
  std::string huge = good.substr(0, 12);
  append(huge, 0xffffffffu, 0xffffffffu);
  CHECK(fault(huge) == "object 0: needs 103079215080 bytes, 0 are left in the file");
  for (std::size_t size = 8; size < good.size(); ++size) CHECK(contains(fault(good.substr(0, size)), "are left in"));
}
