#include "gltf_builder.h"
#include "load.h"

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

const std::vector<float> kTriangle{0, 0, 0, 1, 0, 0, 0, 1, 0};

/// One triangle in one node.
GltfBuilder triangle_file() {
  GltfBuilder b;
  const int positions = b.add_positions(kTriangle);
  const int mesh = b.add_mesh(positions, b.add_accessor<std::uint8_t>({0, 1, 2}, 5121, "SCALAR", 3));
  b.json["nodes"] = {{{"mesh", mesh}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  return b;
}

void check_near(const build::Position& got, const build::Position& expected) {
  for (std::size_t axis = 0; axis < 3; ++axis) CHECK(got[axis] == Approx(expected[axis]).margin(1e-6));
}

}  // namespace

TEST_CASE("glTF: embedded, external and binary buffers give the same mesh; images need not exist") {
  const TempFolder folder;
  GltfBuilder b = triangle_file();
  b.json["images"] = {{{"uri", "missing.png"}}, {{"uri", "data:image/png;base64,AAAA"}}};
  b.json["textures"] = {{{"source", 0}}};
  folder.write("some buffer.bin", b.buffer);
  for (const auto& path :
       {folder.write("a.gltf", b.embedded()), folder.write("b.gltf", b.with_external_buffer("some%20buffer.bin")),
        folder.write("c.glb", b.glb()), folder.write("d.gltf", b.glb()), folder.write("e.GLB", b.glb()),
        folder.write("f.unknown", b.glb())}) {
    INFO(path);
    const auto mesh = load(path);
    CHECK(mesh.positions == Positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    CHECK(mesh.triangles == Triangles{{0, 1, 2}});
  }
}

TEST_CASE("glTF: transforms of nested nodes; a mesh used twice; mirrored nodes keep their outside") {
  const TempFolder folder;
  GltfBuilder b = triangle_file();
  const double h = std::sqrt(0.5);
  b.json["nodes"] = {
      {{"translation", {10, 0, 0}}, {"rotation", {0, 0, h, h}}, {"scale", {2, 1, 1}}, {"children", {1, 2}}},
      {{"mesh", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1}}},
      {{"mesh", 0}, {"scale", {1, -1, 1}}},
      {{"mesh", 0}}};  // Not in the scene.
  const auto mesh = load(folder.write("a.gltf", b.embedded()));
  REQUIRE(mesh.positions.size() == 6);
  // scale(2,1,1), then 90 degrees about z: (x, y, z) -> (-y, 2x, z), then + (10, 0, 0).
  check_near(mesh.positions[0], {8, 2, 3});
  check_near(mesh.positions[1], {8, 4, 3});
  check_near(mesh.positions[2], {7, 2, 3});
  check_near(mesh.positions[3], {10, 0, 0});
  check_near(mesh.positions[4], {10, 2, 0});
  check_near(mesh.positions[5], {11, 0, 0});
  CHECK(mesh.triangles == Triangles{{0, 1, 2}, {3, 5, 4}});
}

TEST_CASE("glTF: without scenes every root counts; the named scene is taken") {
  const TempFolder folder;
  GltfBuilder b = triangle_file();
  b.json["nodes"] = {{{"children", {1}}}, {{"mesh", 0}}, {{"mesh", 0}}};
  b.json.erase("scenes");
  b.json.erase("scene");
  CHECK(load(folder.write("a.gltf", b.embedded())).triangles.size() == 2);
  b.json["scenes"] = {{{"nodes", {0, 2}}}, {{"nodes", {2}}}};
  CHECK(load(folder.write("a.gltf", b.embedded())).triangles.size() == 2);
  b.json["scene"] = 1;
  CHECK(load(folder.write("a.gltf", b.embedded())).triangles.size() == 1);
}

TEST_CASE("glTF: lists, strips and fans, with and without indices; points and lines are left out") {
  const TempFolder folder;
  const std::vector<float> five{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 2, 0};
  const auto triangles = [&](int mode, bool indexed) {
    GltfBuilder b;
    const int positions = b.add_positions(five);
    const int indices = indexed ? b.add_accessor<std::uint16_t>({4, 3, 2, 1, 0}, 5123, "SCALAR", 5) : -1;
    b.json["nodes"] = {{{"mesh", b.add_mesh(positions, indices, mode)}}};
    b.json["scenes"] = {{{"nodes", {0}}}};
    return load(folder.write("a.gltf", b.embedded())).triangles;
  };
  CHECK(triangles(4, false) == Triangles{{0, 1, 2}});
  CHECK(triangles(4, true) == Triangles{{4, 3, 2}});
  CHECK(triangles(5, false) == Triangles{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}});
  CHECK(triangles(5, true) == Triangles{{4, 3, 2}, {3, 1, 2}, {2, 1, 0}});
  CHECK(triangles(6, false) == Triangles{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}});
  CHECK(triangles(6, true) == Triangles{{3, 2, 4}, {2, 1, 4}, {1, 0, 4}});
  for (const int mode : {0, 1, 2, 3}) CHECK(triangles(mode, false).empty());
}

TEST_CASE("glTF: every component type of positions and indices") {
  const TempFolder folder;
  const auto positions_of = [&](GltfBuilder& b, int accessor) {
    b.json["nodes"] = {{{"mesh", b.add_mesh(accessor)}}};
    b.json["scenes"] = {{{"nodes", {0}}}};
    return load(folder.write("a.gltf", b.embedded())).positions;
  };
  GltfBuilder bytes;
  CHECK(positions_of(bytes, bytes.add_accessor<std::int8_t>({0, 0, 0, 1, -2, 127}, 5120, "VEC3", 2)) ==
        Positions{{0, 0, 0}, {1, -2, 127}});
  GltfBuilder normalized;
  const int accessor = normalized.add_accessor<std::int16_t>({32767, -32768, 0}, 5122, "VEC3", 1);
  normalized.json["accessors"][0]["normalized"] = true;
  CHECK(positions_of(normalized, accessor) == Positions{{1, -1, 0}});
  GltfBuilder unsigned_shorts;
  CHECK(positions_of(unsigned_shorts, unsigned_shorts.add_accessor<std::uint16_t>({65535, 1, 0}, 5123, "VEC3", 1)) ==
        Positions{{65535, 1, 0}});
  GltfBuilder interleaved;
  interleaved.add_view<float>({0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9}, 16);
  interleaved.json["accessors"] = {{{"bufferView", 0}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 3}}};
  CHECK(positions_of(interleaved, 0) == Positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  GltfBuilder wide = triangle_file();
  wide.json["meshes"][0]["primitives"][0]["indices"] = wide.add_accessor<std::uint32_t>({2, 1, 0}, 5125, "SCALAR", 3);
  CHECK(load(folder.write("a.gltf", wide.embedded())).triangles == Triangles{{2, 1, 0}});
  GltfBuilder nan = triangle_file();
  const float quiet = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(nan.buffer.data(), &quiet, sizeof(quiet));
  CHECK(std::isnan(load(folder.write("a.glb", nan.glb())).positions[0][0]));
}

TEST_CASE("glTF: sparse accessors, over values and over zeros") {
  const TempFolder folder;
  for (const bool over_zeros : {false, true}) {
    GltfBuilder b = triangle_file();
    const int indices = b.add_view<std::uint16_t>({1, 2}), values = b.add_view<float>({5, 5, 5, 6, 6, 6});
    auto& accessor = b.json["accessors"][0];
    if (over_zeros) accessor.erase("bufferView");
    accessor["sparse"] = {{"count", 2},
                          {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                          {"values", {{"bufferView", values}}}};
    CHECK(load(folder.write("a.gltf", b.embedded())).positions == Positions{{0, 0, 0}, {5, 5, 5}, {6, 6, 6}});
    accessor["sparse"]["count"] = 3;
    CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains("accessor 0"));
    accessor["sparse"]["count"] = 2;
    accessor["count"] = 2;
    CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains("sparse index 1"));
  }
}

TEST_CASE("glTF: accessors that leave their buffer are refused") {
  const TempFolder folder;
  const auto message = [&](const char* list, const char* key, const nlohmann::json& value, std::size_t at = 0) {
    GltfBuilder b = triangle_file();
    b.json[list][at][key] = value;
    return refusal(folder.write("bad.gltf", b.embedded()));
  };
  CHECK_THAT(message("accessors", "count", 4), Contains("mesh 0, accessor 0") && Contains("36 bytes"));
  CHECK_THAT(message("accessors", "count", 4294967297u), Contains("accessor 0"));
  CHECK_THAT(message("accessors", "byteOffset", 4), Contains("accessor 0"));
  CHECK_THAT(message("accessors", "byteOffset", 1000000), Contains("accessor 0"));
  CHECK_THAT(message("accessors", "type", "VEC4"), Contains("VEC3"));
  CHECK_THAT(message("accessors", "bufferView", 7), Contains("bufferView 7"));
  CHECK_THAT(message("accessors", "count", 4, 1), Contains("accessor 1"));
  CHECK_THAT(message("bufferViews", "byteLength", 1000), Contains("bufferView 0"));
  CHECK_THAT(message("bufferViews", "byteOffset", 1000), Contains("bufferView 0"));
  message("bufferViews", "byteStride", 100);
  message("bufferViews", "buffer", 5);
  GltfBuilder b = triangle_file();
  b.json["meshes"][0]["primitives"][0]["indices"] = b.add_accessor<std::uint32_t>({0, 1, 3}, 5125, "SCALAR", 3);
  CHECK_THAT(refusal(folder.write("bad.gltf", b.embedded())), Contains("vertex 3") && Contains("only 3"));
  b.json["meshes"][0]["primitives"][0]["indices"] = 99;
  refusal(folder.write("bad.gltf", b.embedded()));
  b = triangle_file();
  b.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 99;
  CHECK_THAT(refusal(folder.write("bad.gltf", b.embedded())), Contains("accessor 99"));
}

TEST_CASE("glTF: cycles, second parents and missing nodes and meshes are refused") {
  const TempFolder folder;
  const auto message = [&](const nlohmann::json& nodes, const nlohmann::json& scenes) {
    GltfBuilder b = triangle_file();
    b.json["nodes"] = nodes;
    b.json["scenes"] = scenes;
    return refusal(folder.write("bad.gltf", b.embedded()));
  };
  using nlohmann::json;
  const json scene = json::array({{{"nodes", {0}}}});
  CHECK_THAT(message(json::parse(R"([{"children": [1]}, {"children": [0]}])"), scene),
             Contains("node 0") && Contains("cycle"));
  CHECK_THAT(message(json::parse(R"([{"children": [0]}])"), scene), Contains("cycle"));
  CHECK_THAT(message(json::parse(R"([{"children": [1, 2]}, {"children": [2]}, {"mesh": 0}])"), scene),
             Contains("node 2"));
  CHECK_THAT(message(json::parse(R"([{"children": [9]}])"), scene), Contains("node 9"));
  CHECK_THAT(message(json::parse(R"([{"mesh": 3}])"), scene), Contains("mesh 3"));
  CHECK_THAT(message(json::parse(R"([{"mesh": 0, "matrix": [1, 2, 3]}])"), scene), Contains("node 0"));
  GltfBuilder b = triangle_file();
  b.json["scene"] = 5;
  CHECK_THAT(refusal(folder.write("bad.gltf", b.embedded())), Contains("scene is 5"));
  b = triangle_file();
  b.json["nodes"] = json::parse(R"([{"children": [1]}, {"children": [0]}])");
  b.json.erase("scenes");
  b.json.erase("scene");
  CHECK_THAT(refusal(folder.write("bad.gltf", b.embedded())), Contains("cycle"));
}

TEST_CASE("glTF: truncated files, missing buffers and required extensions are refused") {
  const TempFolder folder;
  GltfBuilder b = triangle_file();
  const std::string glb = b.glb(), text = b.embedded();
  for (std::size_t size = 1; size < glb.size(); size += 7) refusal(folder.write("cut.glb", glb.substr(0, size)));
  for (std::size_t size = 1; size < text.size(); size += 7) refusal(folder.write("cut.gltf", text.substr(0, size)));
  refusal(folder.write("bad.gltf", b.with_external_buffer("missing.bin")));
  folder.write("short.bin", b.buffer.substr(0, 10));
  refusal(folder.write("bad.gltf", b.with_external_buffer("short.bin")));
  refusal(folder.write("bad.gltf", "{}"));
  refusal(folder.write("bad.gltf", "[]"));
  refusal(folder.write("bad.gltf", "not json"));
  refusal(folder.write("bad.gltf", std::string(100'000, '[')));
  b.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  CHECK_THAT(refusal(folder.write("bad.gltf", b.embedded())), Contains("KHR_draco_mesh_compression"));
  b.json["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_materials_unlit"};
  CHECK(load(folder.write("good.gltf", b.embedded())).triangles.size() == 1);
}
