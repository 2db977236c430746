/// Skins and morph targets of glTF, by hand.

#include <tests/tools/load.h>
#include "gltf_builder.h"

#include <tools/scene_io/surface/material_library.h>

#include <numbers>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

void check_near(const Positions& got, const Positions& expected) {
  REQUIRE(got.size() == expected.size());
  for (std::size_t i = 0; i < got.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) CHECK(got[i][axis] == Approx(expected[i][axis]).margin(1e-6));
}

const std::vector<float> kTriangle{0, 0, 0, 1, 0, 0, 0, 1, 0};
const std::vector<float> kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// Node 0 has the mesh, a triangle; its skin has nodes 1 and 2 as joints.
struct Skinned : GltfBuilder {
  nlohmann::json& attributes() { return json["meshes"][0]["primitives"][0]["attributes"]; }

  Skinned(const std::vector<std::uint8_t>& joints, const std::vector<float>& weights,
          const std::vector<float>& positions = kTriangle) {
    add_mesh(add_positions(positions));
    attributes()["JOINTS_0"] = add_accessor(joints, 5121, "VEC4", joints.size() / 4);
    attributes()["WEIGHTS_0"] = add_accessor(weights, 5126, "VEC4", weights.size() / 4);
    json["scenes"] = {{{"nodes", {0, 1, 2}}}};
    json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {100, 0, 0}}, {"scale", {-3, 3, 3}}},
                     {{"translation", {0, 0, 2}}},
                     {{"translation", {4, 0, 0}}}};
    json["skins"] = {{{"joints", {1, 2}}}};
  }
  void inverse_binds(const std::vector<float>& matrices) {
    json["skins"][0]["inverseBindMatrices"] = add_accessor(matrices, 5126, "MAT4", matrices.size() / 16);
  }
  tools::Mesh mesh() const {
    const TempFolder folder;
    return load(folder.write("a.gltf", embedded()));
  }
  std::string fault() const {
    const TempFolder folder;
    return refusal(folder.write("a.gltf", embedded()));
  }
};

/// A triangle with two morph targets: up, and along x for the second corner.
struct Morphing : GltfBuilder {
  Morphing() {
    add_mesh(add_positions(kTriangle));
    const int up = add_positions({0, 0, 1, 0, 0, 1, 0, 0, 1});
    // Displacements are mostly zeros: a sparse accessor without a bufferView.
    json["accessors"].push_back({{"componentType", 5126},
                                 {"type", "VEC3"},
                                 {"count", 3},
                                 {"sparse",
                                  {{"count", 1},
                                   {"indices", {{"bufferView", add_view<std::uint16_t>({1})}, {"componentType", 5123}}},
                                   {"values", {{"bufferView", add_view<float>({8, 0, 0})}}}}}});
    json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", up}}, {{"POSITION", json["accessors"].size() - 1}}};
    json["scenes"] = {{{"nodes", {0}}}};
    json["nodes"] = {{{"mesh", 0}}};
  }
  Positions positions() const {
    const TempFolder folder;
    return load(folder.write("a.gltf", embedded())).positions;
  }
};

tools::MeshAssembly load_all(const GltfBuilder& b, const std::vector<float>& times = {}) {
  const TempFolder folder;
  auto assembly = tools::load_assembly(folder.write("a.glb", b.glb()), times);
  if (!assembly) FAIL(assembly.error().message);
  return std::move(*assembly);
}

}  // namespace

TEST_CASE("glTF skins: joints place the vertices, the node does not") {
  // All weight on joint 0; on joint 1; half and half.
  const Skinned b({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0});
  const tools::Mesh mesh = b.mesh();
  check_near(mesh.positions, {{0, 0, 2}, {5, 0, 0}, {2, 1, 1}});
  CHECK(mesh.triangles == Triangles{{0, 1, 2}});
  const auto assembly = load_all(b);
  REQUIRE(assembly.meshes.size() == 1);
  check_near(assembly.meshes[0].positions, mesh.positions);
  CHECK(assembly.uses[0].to_world.m == tools::Transform{}.m);
}

TEST_CASE("glTF skins: a skinned mesh does not follow its node, another use of the mesh does") {
  const TempFolder folder;
  GltfBuilder b;
  b.add_mesh(b.add_positions(kTriangle));
  b.json["scenes"] = {{{"nodes", {0}}}};
  b.json["nodes"] = {{{"translation", {5, 0, 0}}, {"children", {1, 2}}},
                     {{"mesh", 0}, {"skin", 0}, {"scale", {-2, 2, 2}}},
                     {{"mesh", 0}}};
  b.json["skins"] = {{{"joints", {0}}}};
  const auto mesh = load(folder.write("a.gltf", b.embedded()));
  CHECK(mesh.positions == Positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}});
  CHECK(mesh.triangles == Triangles{{0, 1, 2}, {3, 4, 5}});
}

TEST_CASE("glTF skins: inverse bind matrices, joints below other nodes, turned normals") {
  // The joint turns by a quarter about z, at (5, 0, 0) below a node at (0, 0, 7).
  Skinned b({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, {2, 0, 0, 1, 0, 0, 1, 1, 0});
  const double h = std::sqrt(0.5);
  b.json["nodes"][1] = {{"translation", {5, 0, 0}}, {"rotation", {0, 0, h, h}}};
  b.json["nodes"][2] = {{"translation", {0, 0, 7}}, {"children", {1}}};
  b.json["scenes"][0]["nodes"] = {0, 2};
  std::vector<float> binds = kIdentity;
  binds[12] = -1;  // Along x, in the column of the translation.
  binds.insert(binds.end(), kIdentity.begin(), kIdentity.end());
  b.inverse_binds(binds);
  check_near(b.mesh().positions, {{5, 1, 7}, {5, 0, 7}, {4, 0, 7}});
  b.attributes()["NORMAL"] = b.add_accessor<float>({1, 0, 0, 0, 0, 2, 0, 1, 0}, 5126, "VEC3", 3);
  const TempFolder folder;
  tools::MaterialLibrary library;
  const auto mesh = tools::load_mesh(folder.write("a.gltf", b.embedded()), &library);
  REQUIRE(mesh);
  check_near(mesh->surface->normals, {{0, 1, 0}, {0, 0, 1}, {-1, 0, 0}});
}

TEST_CASE("glTF skins: weights of any sum, of whole numbers and of two sets; vertices without weight stay") {
  check_near(Skinned({0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {2, 6, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1}).mesh().positions,
             {{3, 0, 0.5f}, {1, 0, 0}, {0, 1, 2}});
  Skinned b({0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  b.attributes()["WEIGHTS_0"] =
      b.add_accessor<std::uint8_t>({51, 204, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, 5121, "VEC4", 3);
  b.json["accessors"].back()["normalized"] = true;
  check_near(b.mesh().positions, {{3.2f, 0, 0.4f}, {1, 0, 2}, {0, 1, 2}});
  b.attributes()["JOINTS_1"] = b.add_accessor<std::uint16_t>({0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0}, 5123, "VEC4", 3);
  b.attributes()["WEIGHTS_1"] = b.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0}, 5126, "VEC4", 3);
  check_near(b.mesh().positions, {{3.6f, 0, 0.2f}, {1, 0, 2}, {0, 1, 2}});
}

TEST_CASE("glTF skins: what is wrong is named") {
  const std::vector<std::uint8_t> joints{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  const std::vector<float> weights{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  CHECK_THAT(Skinned({0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0}, weights).fault(),
             Contains("mesh 0, primitive 0: vertex 1: joint 9") && Contains("only 2"));
  Skinned b(joints, weights);
  b.json["nodes"][0]["skin"] = 3;
  CHECK_THAT(b.fault(), Contains("skin 3: it does not exist; there are 1"));
  b = Skinned(joints, weights);
  b.json["skins"][0]["joints"] = {1, 77};
  CHECK_THAT(b.fault(), Contains("skin 0: joint 1 is node 77"));
  b = Skinned(joints, weights);
  b.inverse_binds(kIdentity);
  CHECK_THAT(b.fault(), Contains("skin 0: inverseBindMatrices has 1 elements for 2 joints"));
  b.json["skins"][0]["inverseBindMatrices"] = 0;
  CHECK_THAT(b.fault(), Contains("skin 0: accessor 0: it is not of type MAT4"));
  b = Skinned(joints, weights);
  b.attributes().erase("WEIGHTS_0");
  CHECK_THAT(b.fault(), Contains("WEIGHTS_0 is missing"));
  b = Skinned(joints, {1, 0, 0, 0});
  CHECK_THAT(b.fault(), Contains("WEIGHTS_0 has 1 elements, but POSITION has 3"));
  b = Skinned(joints, weights);
  b.json["skins"][0] = {{"name", "none"}};
  CHECK_THAT(b.fault(), Contains("skin 0: 'joints' are missing"));
}

TEST_CASE("glTF morph targets: weights of the mesh, or of the node in their place") {
  Morphing b;
  check_near(b.positions(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  b.json["meshes"][0]["weights"] = {0.5, 0.25};
  check_near(b.positions(), {{0, 0, 0.5f}, {3, 0, 0.5f}, {0, 1, 0.5f}});
  b.json["nodes"][0]["weights"] = {0, -1};
  check_near(b.positions(), {{0, 0, 0}, {-7, 0, 0}, {0, 1, 0}});
  b.json["nodes"][0]["weights"] = {2};
  check_near(b.positions(), {{0, 0, 2}, {1, 0, 2}, {0, 1, 2}});
}

TEST_CASE("glTF morph targets: nodes with weights of their own have a mesh of their own") {
  Morphing b;
  b.json["meshes"][0]["weights"] = {1, 0};
  b.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"weights", {3, 0}}}, {{"mesh", 0}, {"translation", {9, 0, 0}}}};
  b.json["scenes"][0]["nodes"] = {0, 1, 2};
  const auto assembly = load_all(b);
  REQUIRE((assembly.meshes.size() == 2 && assembly.uses.size() == 3));
  CHECK((assembly.uses[0].mesh == 0 && assembly.uses[1].mesh == 1 && assembly.uses[2].mesh == 0));
  CHECK((assembly.meshes[0].positions[0][2] == 1 && assembly.meshes[1].positions[0][2] == 3));
  CHECK(assembly.meshes[1].name == "a.glb mesh 0 of node 1");
}

TEST_CASE("glTF morph targets: animated weights have their values at each time") {
  Morphing b;
  const auto animate = [&](const std::vector<float>& weights, const std::string& interpolation) {
    b.json.erase("animations");
    b.animate(0, "weights", {0, 2}, weights, interpolation);
  };
  animate({0, 1, 4, 0}, "LINEAR");
  const auto still = load_all(b, {0.5f});
  check_near(still.meshes[0].positions, {{0, 0, 1}, {7, 0, 1}, {0, 1, 1}});
  CHECK((still.meshes[0].keys == 1 && still.warnings.empty()));
  const auto moving = load_all(b, {0.5f, 1});
  REQUIRE((moving.meshes.size() == 1 && moving.meshes[0].keys == 2 && moving.warnings.empty()));
  check_near(moving.meshes[0].positions, {{0, 0, 1}, {7, 0, 1}, {0, 1, 1}, {0, 0, 2}, {5, 0, 2}, {0, 1, 2}});
  CHECK(moving.meshes[0].triangles == std::vector<build::Triangle>{{0, 1, 2}});
  CHECK(moving.uses[0].keys.empty());
  // Behind the last key it stands still.
  CHECK((load_all(b, {2, 3}).meshes[0].keys == 1 && load_all(b, {1.5f, 2, 3}).meshes[0].keys == 3));
  CHECK(load_all(b).warnings == std::vector<std::string>{"ignored: animations (1)"});
  // Tangents of 0: at the middle the mean.
  animate({9, 9, 0, 1, 0, 0, 0, 0, 4, 0, 9, 9}, "CUBICSPLINE");
  check_near(load_all(b, {1}).meshes[0].positions, {{0, 0, 2}, {5, 0, 2}, {0, 1, 2}});
  animate({0, 1, 4}, "LINEAR");
  const TempFolder folder;
  const auto wrong = tools::load_assembly(folder.write("a.glb", b.glb()), {0});
  REQUIRE_FALSE(wrong);
  CHECK_THAT(wrong.error().message, Contains("animation 0, channel 0: 3 weights, a multiple of 2 expected"));
}

TEST_CASE("glTF: a mesh deforms for the nodes that deform it, and stands still for others") {
  Morphing b;
  b.json["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"weights", {0, 0}}}, {{"mesh", 0}}};
  b.json["scenes"][0]["nodes"] = {0, 1, 2};
  b.animate(1, "weights", {0, 1}, {0, 0, 1, 0});
  b.animate(2, "translation", {0, 1}, {0, 0, 0, 7, 0, 0});
  const auto assembly = load_all(b, {0, 0.5f, 1});
  REQUIRE((assembly.meshes.size() == 2 && assembly.uses.size() == 3));
  CHECK((assembly.meshes[0].keys == 1 && assembly.meshes[1].keys == 3));
  CHECK((assembly.uses[0].mesh == 0 && assembly.uses[1].mesh == 1 && assembly.uses[2].mesh == 0));
  CHECK((assembly.uses[1].keys.empty() && assembly.uses[2].keys.size() == 3));
}

TEST_CASE("glTF skins: vertices follow their joints, and joints at rest deform nothing") {
  Skinned b({0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.5f, 0, 0});
  b.animate(1, "translation", {0, 1}, {0, 0, 2, 0, 8, 2});
  const auto moving = load_all(b, {0, 0.25f, 1});
  REQUIRE((moving.meshes.size() == 1 && moving.meshes[0].keys == 3 && moving.warnings.empty()));
  check_near(moving.meshes[0].positions,
             {{0, 0, 2}, {5, 0, 0}, {2, 1, 1}, {0, 2, 2}, {5, 0, 0}, {2, 2, 1}, {0, 8, 2}, {5, 0, 0}, {2, 5, 1}});
  CHECK(load_all(b, {1, 2, 3}).meshes[0].keys == 1);
  // A node that moves, but is no joint.
  b.json.erase("animations");
  b.animate(0, "translation", {0, 1}, {0, 0, 2, 0, 8, 2});
  const auto rigid = load_all(b, {0, 1});
  CHECK((rigid.meshes[0].keys == 1 && rigid.uses[0].keys.empty()));
}

TEST_CASE("glTF: triangles whose deformed vertices are not finite are left out, with a warning") {
  Morphing b;
  const int far = b.add_positions({0, 0, 0, 3e38f, 0, 0, 0, 0, 0});
  auto& primitives = b.json["meshes"][0]["primitives"];
  primitives[0]["targets"][1]["POSITION"] = far;
  primitives.push_back({{"attributes", {{"POSITION", b.add_positions(kTriangle)}}}});
  b.animate(0, "weights", {0, 1}, {0, 0, 1, 10});
  const auto assembly = load_all(b, {0, 1});
  const tools::Mesh& mesh = assembly.meshes.at(0);
  REQUIRE((mesh.keys == 2 && mesh.triangles.size() == 2));
  CHECK(mesh.triangles[0] == build::Triangle{0, 0, 0});
  CHECK(mesh.triangles[1] == build::Triangle{3, 4, 5});
  CHECK((mesh.positions[1] == build::Position{0, 0, 0} && mesh.positions[7] == build::Position{0, 0, 0}));
  CHECK(assembly.warnings ==
        std::vector<std::string>{"a.glb mesh 0 of node 0: deformed, 1 triangles have coordinates that are not finite; "
                                 "they are left out"});
}

TEST_CASE("glTF: each corner and each key can make a deformed triangle one that is left out") {
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (std::size_t bad_key = 0; bad_key < 3; ++bad_key) {
      CAPTURE(corner, bad_key);
      Morphing b;
      std::vector<float> moves(9, 0.0f), weights(6, 0.0f);
      moves[3 * corner + 1] = 3e38f;
      weights[2 * bad_key + 1] = 10;
      b.json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = b.add_positions(moves);
      b.animate(0, "weights", {0, 1, 2}, weights);
      const tools::Mesh mesh = load_all(b, {0, 1, 2}).meshes.at(0);
      REQUIRE((mesh.keys == 3 && mesh.positions.size() == 9));
      CHECK(mesh.triangles == std::vector<build::Triangle>{{0, 0, 0}});
      for (std::size_t i = 0; i < 9; ++i) {
        const build::Position kept{kTriangle[3 * (i % 3)], kTriangle[3 * (i % 3) + 1], kTriangle[3 * (i % 3) + 2]};
        CHECK(mesh.positions[i] == (i % 3 == corner ? build::Position{0, 0, 0} : kept));
      }
    }
}

TEST_CASE("glTF morph targets: what is wrong is named") {
  const TempFolder folder;
  Morphing b;
  b.json["meshes"][0]["weights"] = {1, 1};
  b.json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = b.add_positions({1, 2, 3});
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())),
             Contains("mesh 0, primitive 0: target 1, POSITION: 1 elements") && Contains("3 vertices"));
  b.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", "x"}}};
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains("mesh 0, primitive 0, target 0: 'POSITION'"));
  b.json["meshes"][0]["weights"] = {1, "x"};
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains("'weights'") || Contains("'POSITION'"));
}
