/// glTF files as objects and their instances.

#include <tests/tools/load.h>
#include "gltf_builder.h"

using namespace hiprt;
using namespace hiprt::test;
using nlohmann::json;

namespace {

/// Three meshes: two of a triangle, and one of lines, which is skipped.
GltfBuilder two_triangles() {
  GltfBuilder b;
  for (const float z : {0.f, 1.f}) b.add_mesh(b.add_positions({0, 0, z, 1, 0, z, 0, 1, z}));
  b.add_mesh(b.add_positions({0, 0, 0, 1, 0, 0}), -1, 1);
  b.json["scenes"] = {{{"nodes", {0}}}};
  return b;
}

tools::MeshAssembly load_all(const GltfBuilder& b) {
  const TempFolder folder;
  auto assembly = tools::load_assembly(folder.write("a.glb", b.glb()));
  if (!assembly) FAIL(assembly.error().message);
  return std::move(*assembly);
}

std::string fault(const GltfBuilder& b) {
  const TempFolder folder;
  const auto assembly = tools::load_assembly(folder.write("a.glb", b.glb()));
  if (assembly) FAIL("accepted");
  return assembly.error().message;
}

void check_origin(const tools::MeshUse& use, double x, double y, double z) {
  CHECK(use.to_world.m[0][3] == Approx(x).margin(1e-7));
  CHECK(use.to_world.m[1][3] == Approx(y).margin(1e-7));
  CHECK(use.to_world.m[2][3] == Approx(z).margin(1e-7));
}

/// Node 0 has mesh 1 as often as the attributes say.
GltfBuilder instanced(const json& attributes) {
  GltfBuilder b = two_triangles();
  b.json["nodes"] = {{{"mesh", 1},
                      {"translation", {5, 0, 0}},
                      {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", attributes}}}}}}};
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  b.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  return b;
}

}  // namespace

TEST_CASE("glTF instances: every mesh is read once in its own space, and nodes become its uses") {
  GltfBuilder b = two_triangles();
  b.json["nodes"] = {{{"translation", {1, 2, 3}}, {"mesh", 1}, {"children", {1, 2, 3}}},
                     {{"mesh", 1}, {"scale", {-2, 1, 1}}},
                     {{"mesh", 0}, {"translation", {0, 0, 1}}},
                     {{"mesh", 2}}};
  const auto assembly = load_all(b);
  REQUIRE(assembly.meshes.size() == 2);
  CHECK(assembly.meshes[0].name == "a.glb mesh 1");
  CHECK(assembly.meshes[0].positions == Positions{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  CHECK(assembly.meshes[1].name == "a.glb mesh 0");
  REQUIRE(assembly.uses.size() == 3);
  CHECK(assembly.uses[0].mesh == 0);
  CHECK(assembly.uses[1].mesh == 0);
  CHECK(assembly.uses[2].mesh == 1);
  check_origin(assembly.uses[1], 1, 2, 3);
  check_origin(assembly.uses[2], 1, 2, 4);
  CHECK(assembly.uses[1].to_world.m[0][0] == -2);
}

TEST_CASE("glTF instances: other formats give one mesh that is used once") {
  const TempFolder folder;
  const auto assembly = tools::load_assembly(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  REQUIRE(assembly);
  REQUIRE(assembly->meshes.size() == 1);
  CHECK(assembly->meshes[0].name == "a.obj");
  REQUIRE(assembly->uses.size() == 1);
  check_origin(assembly->uses[0], 0, 0, 0);
}

TEST_CASE("glTF instances: EXT_mesh_gpu_instancing") {
  GltfBuilder b = instanced({});
  const float h = std::sqrt(0.5f);
  const int translation = b.add_positions({0, 0, 0, 0, 7, 0}), scale = b.add_positions({1, 1, 1, 2, 3, 4}),
            rotation = b.add_accessor<float>({0, 0, 0, 1, 0, 0, h, h}, 5126, "VEC4", 2);
  json& attributes = b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes = {{"TRANSLATION", translation}, {"ROTATION", rotation}, {"SCALE", scale}, {"_ID", 0}};
  const auto assembly = load_all(b);
  REQUIRE(assembly.meshes.size() == 1);
  REQUIRE(assembly.uses.size() == 2);
  check_origin(assembly.uses[0], 5, 0, 0);
  check_origin(assembly.uses[1], 5, 7, 0);
  CHECK(assembly.uses[1].to_world.m[0][1] == Approx(-3));
  CHECK(assembly.uses[1].to_world.m[1][0] == Approx(2));
  CHECK(assembly.uses[1].to_world.m[2][2] == 4);
  // Flattened files do not know it.
  const TempFolder folder;
  CHECK(contains(refusal(folder.write("a.glb", b.glb())), "not supported without instances"));
}

TEST_CASE("glTF instances: faults of EXT_mesh_gpu_instancing are reported with the node") {
  const std::string node = "node 0, EXT_mesh_gpu_instancing: ";
  CHECK(contains(fault(instanced({{"TRANSLATION", 99}})), node + "TRANSLATION: accessor 99: it does not exist"));
  CHECK(contains(fault(instanced({{"TRANSLATION", "x"}})), node + "TRANSLATION is not the number of an accessor"));
  CHECK(contains(fault(instanced({{"ROTATION", 0}})), node + "ROTATION: accessor 0: it is not of type VEC4"));
  CHECK(contains(fault(instanced({{"_ID", 0}})), node + "neither TRANSLATION nor ROTATION nor SCALE"));
  CHECK(contains(fault(instanced(5)), node + "'attributes' are missing"));
  // Accessor 2 has two elements, accessor 0 three.
  CHECK(contains(fault(instanced({{"TRANSLATION", 0}, {"SCALE", 2}})), node + "TRANSLATION, ROTATION and SCALE have"));
  GltfBuilder b = instanced({});
  const int rotation = b.add_accessor<float>({0, 0, 0, 2}, 5126, "VEC4", 1);
  b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"ROTATION", rotation}};
  CHECK(contains(fault(b), node + "instance 0: its rotation has the length 2.0"));
}
