/// glTF files as encoders and exporters write them: compression, zeros, truncated buffers, and what is ignored.

#include <tests/tools/load.h>
#include "compressed_gltf.h"

#include <tools/scene_io/gltf/gltf_compression.h>
#include <tools/scene_io/surface/material_library.h>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

const Positions kSquare{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};

/// Sums of areas, z components: what a square of any order of corners has.
double area_of(const tools::Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const auto &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    sum += 0.5 * ((double{b[0]} - a[0]) * (double{c[1]} - a[1]) - (double{b[1]} - a[1]) * (double{c[0]} - a[0]));
  }
  return sum;
}

void check_square(const tools::Mesh& mesh) {
  Positions sorted = mesh.positions, expected = kSquare;
  std::sort(sorted.begin(), sorted.end());
  std::sort(expected.begin(), expected.end());
  CHECK(sorted == expected);
  CHECK(mesh.triangles.size() == 2);
  CHECK(area_of(mesh) == Approx(1));
  CHECK(mesh.warnings.empty());
}

GltfBuilder square() {
  GltfBuilder b;
  const int positions = b.add_positions({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  b.add_mesh(positions, b.add_accessor<std::uint16_t>({0, 1, 2, 0, 2, 3}, 5123, "SCALAR", 6));
  b.json["nodes"] = {{{"mesh", 0}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  return b;
}

}  // namespace

TEST_CASE("glTF files: Draco's meshes are decoded, or the error names the package") {
  const TempFolder folder;
  for (const std::string& data : {kEdgebreaker, kSequential}) {
    const GltfBuilder b = draco_file(data);
    if (!tools::has_draco()) {
      CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())),
                 Contains("KHR_draco_mesh_compression") && Contains("libdraco-dev"));
      continue;
    }
    check_square(load(folder.write("a.gltf", b.embedded())));
    check_square(load(folder.write("a.glb", b.glb())));
  }
  if (!tools::has_draco()) return;
  const std::string where = "meshes[0].primitives[0].extensions.KHR_draco_mesh_compression";
  GltfBuilder b = draco_file(kSequential.substr(0, 40));
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains(where) && Contains("damaged"));
  b = draco_file(kSequential);
  b.json["accessors"][0]["count"] = 5;
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains(where + ".attributes.POSITION: 4 points"));
  b = draco_file(kSequential);
  b.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 7;
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains("no such attribute"));
}

TEST_CASE("glTF files: meshopt's buffers are decoded, or the error names the package") {
  const TempFolder folder;
  const std::string plain = with_fallback(meshopt_file(kMeshoptVertices, "NONE", kMeshoptTriangles, "TRIANGLES"));
  if (!tools::has_meshopt()) {
    CHECK_THAT(refusal(folder.write("a.gltf", plain)),
               Contains("EXT_meshopt_compression") && Contains("libmeshoptimizer-dev"));
    return;
  }
  check_square(load(folder.write("a.gltf", plain)));
  check_square(
      load(folder.write("a.gltf", with_fallback(meshopt_file(kMeshoptVertices, "NONE", kMeshoptSequence, "INDICES")))));
  check_square(load(folder.write(
      "a.gltf", with_fallback(meshopt_file(kMeshoptExponential, "EXPONENTIAL", kMeshoptSequence, "INDICES")))));
  const auto fault = [&](const std::string& pointer, const json& value) {
    json document = json::parse(plain);
    document[json::json_pointer("/bufferViews/1/extensions/EXT_meshopt_compression" + pointer)] = value;
    return refusal(folder.write("a.gltf", document.dump()));
  };
  const std::string where = "bufferViews[1].extensions.EXT_meshopt_compression";
  CHECK_THAT(fault("/mode", "WAVES"), Contains(where + ".mode"));
  CHECK_THAT(fault("/filter", "QUATERNION"), Contains(where + ".filter"));
  CHECK_THAT(fault("/byteStride", 6), Contains(where + ".byteStride: 6"));
  CHECK_THAT(fault("/count", 4294967295u), Contains(where + ".count") && Contains("compressed bytes"));
  CHECK_THAT(fault("/count", 3), Contains("damaged") || Contains("do not fit"));
  CHECK_THAT(fault("/buffer", 9), Contains(where + ".buffer"));
  CHECK_THAT(fault("/byteLength", 9), Contains(where + ": its compressed data is damaged"));
}

TEST_CASE("glTF files: an extension that is required and unknown is named before all other faults") {
  const TempFolder folder;
  GltfBuilder b = square();
  b.json["extensionsRequired"] = {"ACME_tesseracts"};
  b.json["accessors"][0]["bufferView"] = "x";
  b.json["asset"]["version"] = "7";
  CHECK_THAT(
      refusal(folder.write("a.gltf", b.embedded())),
      Contains("it requires the extension 'ACME_tesseracts', which is not supported: export the file without it"));
}

TEST_CASE("glTF files: an accessor without bufferView is zeros") {
  const TempFolder folder;
  GltfBuilder b = square();
  b.json["accessors"][0].erase("bufferView");
  CHECK(load(folder.write("a.gltf", b.embedded())).positions == Positions(4, build::Position{0, 0, 0}));
  b = square();
  b.json["accessors"][1].erase("bufferView");
  const tools::Mesh mesh = load(folder.write("a.gltf", b.embedded()));
  CHECK((mesh.positions == kSquare && mesh.triangles == Triangles{{0, 0, 0}, {0, 0, 0}}));
  b.json["accessors"][1]["count"] = 30000;
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())),
             Contains("accessor 1") && Contains("30000 elements of zeros") && Contains("60 bytes"));
}

TEST_CASE("glTF files: cut files and buffers are named with what is there and what should be") {
  const TempFolder folder;
  const GltfBuilder b = square();
  const std::string glb = b.glb();
  CHECK_THAT(refusal(folder.write("a.glb", glb.substr(0, glb.size() - 10))),
             Contains("truncated: the header says " + std::to_string(glb.size()) + " bytes, but the file has " +
                      std::to_string(glb.size() - 10)));
  folder.write("short.bin", b.buffer.substr(0, 10));
  folder.write("long.bin", b.buffer + "padding");
  const std::string cut = "buffer 0: truncated: its 'byteLength' is 60, but there are only 10 bytes";
  CHECK_THAT(refusal(folder.write("a.gltf", b.with_external_buffer("short.bin"))), Contains(cut));
  CHECK_THAT(refusal(folder.write("a.gltf", b.with_external_buffer("data:application/octet-stream;base64," +
                                                                   base64(b.buffer.substr(0, 10))))),
             Contains(cut));
  CHECK(load(folder.write("a.gltf", b.with_external_buffer("long.bin"))).positions == kSquare);
  CHECK_THAT(refusal(folder.write("a.gltf", b.with_external_buffer("none.bin"))), Contains("none.bin': No such file"));
  json document = json::parse(b.embedded());
  document["buffers"][0].erase("uri");
  CHECK_THAT(refusal(folder.write("a.gltf", document.dump())), Contains("buffer 0: it has no 'uri'"));
}

TEST_CASE("glTF files: what is ignored is named once, with counts") {
  const TempFolder folder;
  GltfBuilder b = square();
  b.add_mesh(0, -1, 0);
  b.add_mesh(0, -1, 1);
  b.add_mesh(0, -1, 3);
  b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}}};
  b.json["nodes"].push_back({{"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  b.json["nodes"].push_back({{"extensions", {{"ACME_a", true}, {"KHR_lights_punctual", {{"light", 0}}}}}});
  b.json["scenes"].push_back({{"nodes", {1}}});
  b.json["materials"] = {{{"extensions", {{"KHR_materials_unlit", json::object()}}}}};
  const std::string path = folder.write("a.gltf", b.embedded());
  CHECK(
      load(path).warnings ==
      std::vector<std::string>{"ignored: primitives of points (1), primitives of lines (2), cameras (1), other scenes "
                               "(1), extension 'ACME_a' (1), extension 'KHR_lights_punctual' (2)"});
  const auto assembly = tools::load_assembly(path);
  REQUIRE(assembly);
  CHECK(assembly->warnings == load(path).warnings);
  tools::MaterialLibrary library;
  CHECK_THAT(tools::load_mesh(path, &library)->warnings.at(0), Contains("extension 'KHR_materials_unlit' (1)"));
}

TEST_CASE("glTF files: what materials have and the path tracer ignores is named") {
  const TempFolder folder;
  GltfBuilder b = square();
  b.json["images"] = {{{"uri", "none.png"}}};
  b.json["textures"] = {{{"source", 0}}};
  b.json["materials"] = {
      {{"normalTexture", {{"index", 0}}},
       {"occlusionTexture", {{"index", 0}}},
       {"alphaMode", "BLEND"},
       {"emissiveTexture", {{"index", 0}, {"texCoord", 1}}},
       {"pbrMetallicRoughness",
        {{"baseColorTexture", {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"texCoord", 2}}}}}}}}}}};
  b.json["meshes"][0]["primitives"][0]["material"] = 0;
  b.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 0;
  tools::MaterialLibrary library;
  const auto mesh = tools::load_mesh(folder.write("a.gltf", b.embedded()), &library);
  REQUIRE(mesh);
  CHECK(mesh->warnings ==
        std::vector<std::string>{
            "ignored: primitives' vertex colours (1), textures with coordinates other than TEXCOORD_0 (2), normal "
            "textures (1), occlusion textures (1), half transparency of materials (cut at 0.5) (1)"});
  CHECK(library.textures.empty());
}
