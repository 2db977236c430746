/// Scenes of instances as plain meshes.

#include "load.h"
#include "two_levels.h"

#include <tools/scene_io/scene/scene_flatten.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::test;
using build::Instance;

namespace {

/// The group mirrored, and a mask that goes with all.
tools::SceneDescription mirrored() {
  tools::SceneDescription scene = two_levels();
  scene.groups[0].instances[1].mask = 0xffffffffu;
  scene.groups[1].instances[0].to_scene = scaled_and_moved(1, 1, -1, 100);
  return scene;
}

std::string fault(const tools::SceneDescription& scene) {
  const auto flat = tools::flatten_scene(scene);
  if (flat) FAIL("accepted");
  return flat.error().message;
}

}  // namespace

TEST_CASE("Scene flattened: depth first, transforms in double, masks; mirrors keep front faces in front") {
  const auto scene = mirrored();
  const auto flat = tools::flatten_scene(scene);
  REQUIRE(flat);
  REQUIRE(flat->size() == 4);
  CHECK(*(*flat)[0].name == "b");
  CHECK((*flat)[0].positions == Positions{{110, 0, -4}, {112, 0, -4}, {110, 2, -4}});
  CHECK((*flat)[0].triangles == Triangles{{0, 2, 1}});
  CHECK((*flat)[0].mask == 6);
  CHECK(*(*flat)[1].name == "a");
  CHECK((*flat)[1].positions[0] == build::Position{110, 0, -2});
  CHECK((*flat)[2].positions[0] == build::Position{100, 0, -1});
  CHECK((*flat)[2].mask == 0xffffffffu);
  CHECK((*flat)[3].positions == scene.meshes[0].positions);
  CHECK((*flat)[3].triangles == Triangles{{0, 1, 2}});
  CHECK((*flat)[3].mask == 8);
  const auto views = tools::views(*flat);
  REQUIRE(views.size() == 4);
  CHECK(views[3].mask == 8);
  CHECK(views[1].name == "a");
}

TEST_CASE("Scene flattened: products are rounded once") {
  tools::SceneDescription scene = mirrored();
  // 1 / 3 of 3 in floats would not be 1.
  scene.groups[0].instances[1].to_scene = scaled_and_moved(1.0f / 3.0f, 1, 1, 0);
  scene.groups[1].instances[0].to_scene = scaled_and_moved(16777216.0f, 1, 1, 1.0f);
  const auto flat = tools::flatten_scene(scene);
  REQUIRE(flat);
  CHECK((*flat)[2].positions[1][0] == static_cast<float>(16777216.0 * static_cast<double>(1.0f / 3.0f) + 1.0));
}

TEST_CASE("Scene flattened: masks that no single mask can replace, and too many triangles") {
  tools::SceneDescription scene = mirrored();
  scene.groups[1].instances[0].mask = 2;
  CHECK((*tools::flatten_scene(scene))[0].mask == 2);
  scene.groups[1].instances[0].mask = 12;
  CHECK(fault(scene) ==
        "s: groups.low[0].mask: 6 below an instance of mask 12 cannot be flattened, no one mask is the same as both");
  scene = mirrored();
  // 2^31 triangles, by doubling; then more than 64 bits hold.
  for (unsigned levels : {31u, 200u}) {
    scene.groups.assign(1, {"groups.0", {Instance{.object = 0}}});
    for (std::uint32_t i = 1; i <= levels; ++i)
      scene.groups.push_back({"groups", {Instance{.object = 1 + i}, Instance{.object = 1 + i}}});
    CHECK(contains(fault(scene), "the limit is 268435456"));
  }
  CHECK(contains(fault(scene), "geometries"));
}
