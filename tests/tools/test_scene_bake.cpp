/// Instances without inverse become objects of their own.

#include "load.h"
#include "two_levels.h"

#include <tools/scene_io/scene/scene_bake.h>

#include <tests/catch.h>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using build::Instance;

TEST_CASE("is_invertible() accepts the transforms that an instance may have") {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  CHECK(build::is_invertible({}));
  CHECK_FALSE(build::is_invertible(scaled_and_moved(1, -1e-30f, 1e-30f, 1e30f)));
  CHECK(build::is_invertible(scaled_and_moved(1e-6f, -1, 1, 5)));
  CHECK_FALSE(build::is_invertible(scaled_and_moved(1, 0, 1, 0)));
  CHECK_FALSE(build::is_invertible(scaled_and_moved(1, 1, 1, kInfinity)));
}

TEST_CASE("Scene baked: a scene whose transforms all have an inverse stays unchanged") {
  auto scene = two_levels();
  const auto baked = tools::bake_singular(scene);
  REQUIRE(baked);
  CHECK(baked->instances == 0);
  CHECK(scene.objects.size() == 2);
  CHECK(scene.meshes.size() == 2);
  CHECK(scene.groups[1].instances[0].object == 2);
}

TEST_CASE("Scene baked: a flat object, and groups keep their numbers behind the new objects") {
  auto scene = two_levels();
  scene.groups[0].instances[0].to_scene = scaled_and_moved(2, 3, 0, 10);
  scene.groups[0].instances[0].id = 77;
  const auto baked = tools::bake_singular(scene);
  REQUIRE(baked);
  CHECK(baked->instances == 1);
  CHECK(baked->triangles == 2);
  CHECK(baked->first == "groups.low[0]");
  REQUIRE(scene.objects.size() == 3);
  CHECK(scene.objects[2].meshes == std::vector<std::size_t>{2, 3});
  REQUIRE(scene.meshes.size() == 4);
  CHECK(scene.meshes[2].name == "b");
  CHECK(scene.meshes[2].positions == Positions{{10, 0, 0}, {12, 0, 0}, {10, 3, 0}});
  CHECK(scene.meshes[2].triangles == Triangles{{0, 1, 2}});
  const Instance& made = scene.groups[0].instances[0];
  CHECK(made.object == 2);
  CHECK(made.id == 77);
  CHECK(made.mask == 6);
  CHECK(build::is_invertible(made.to_scene));
  CHECK(scene.groups[0].instances[1].object == 0);
  CHECK(scene.groups[1].instances[0].object == 3);
  CHECK(scene.groups[1].instances[1].object == 0);
}

TEST_CASE("Scene baked: a flat group becomes an instance per mask") {
  auto scene = two_levels();
  scene.groups[1].instances[0].to_scene = scaled_and_moved(0, 1, 1, 100);
  const auto baked = tools::bake_singular(scene);
  REQUIRE(baked);
  CHECK(baked->instances == 1);
  CHECK(baked->triangles == 3);
  CHECK(scene.objects.size() == 4);
  const auto& top = scene.groups[1].instances;
  REQUIRE(top.size() == 3);
  CHECK(top[0].object == 2);
  CHECK(top[0].mask == 5);
  CHECK(scene.meshes[scene.objects[2].meshes[0]].positions == Positions{{100, 0, 1}, {100, 0, 1}, {100, 1, 1}});
  CHECK(top[1].object == 3);
  CHECK(top[1].mask == 6);
  CHECK(scene.objects[3].meshes.size() == 2);
  CHECK(scene.meshes[scene.objects[3].meshes[0]].positions == Positions{{100, 0, 4}, {100, 0, 4}, {100, 2, 4}});
  CHECK(top[2].object == 0);
  // The group below is still there, for others.
  CHECK(scene.groups[0].instances[0].object == 1);
}

TEST_CASE(
    "Scene baked: normals are transformed, and instances that cannot be flattened are left for the builder to refuse") {
  auto scene = two_levels();
  scene.meshes[0].surface = tools::MeshSurface{{0}, {}, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}};
  scene.groups[1].instances[1].to_scene = scaled_and_moved(1, 1, 0, 0);
  SECTION("normals") {
    REQUIRE(tools::bake_singular(scene));
    REQUIRE(scene.meshes.size() == 3);
    REQUIRE(scene.meshes[2].surface);
    for (const auto& normal : scene.meshes[2].surface->normals) CHECK(normal == std::array<float, 3>{0, 0, 1});
    return;
  }
  build::Motion motion{.keys = {{.time = 0}, {.time = 1}}};
  SECTION("a motion of its own") { scene.groups[1].instances[1].motion = &motion; }
  SECTION("spheres") {
    scene.shapes.resize(1);
    scene.objects[0].shapes = {0};
  }
  SECTION("not finite") { scene.groups[1].instances[1].to_scene.row[1][2] = std::numeric_limits<float>::quiet_NaN(); }
  SECTION("two masks that no one is the same as") {
    scene.groups[1].instances[1] = {.object = 2, .to_scene = scaled_and_moved(1, 1, 0, 0), .mask = 12};
  }
  const auto baked = tools::bake_singular(scene);
  REQUIRE(baked);
  CHECK(baked->instances == 0);
  CHECK(scene.objects.size() == 2);
}
