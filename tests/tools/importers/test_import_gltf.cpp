#include <tests/tools/load.h>
#include "gltf_builder.h"

#include <limits>

#include <sys/stat.h>

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

/// How the file with that value in place of another is refused, as text and as binary.
std::string refusal_of(const std::string& pointer, const nlohmann::json& value) {
  const TempFolder folder;
  GltfBuilder b = triangle_file();
  b.json["accessors"][0]["byteOffset"] = 0;
  b.json[nlohmann::json::json_pointer(pointer)] = value;
  INFO(pointer << " = " << value);
  std::string text = refusal(folder.write("bad.gltf", b.embedded()));
  CHECK(refusal(folder.write("bad.glb", b.glb())).size() >= text.size() - 1);
  return text;
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

TEST_CASE("glTF: lists, strips and fans, with and without indices; points and lines are skipped") {
  const TempFolder folder;
  const auto file = [&](int mode, bool indexed, std::size_t corners) {
    std::vector<float> positions{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 2, 0, 3, 3, 0};
    std::vector<std::uint16_t> numbers{4, 3, 2, 1, 0, 5};
    if (!indexed) positions.resize(3 * corners);
    numbers.resize(corners);
    GltfBuilder b;
    const int vertices = b.add_positions(positions);
    const int indices = indexed ? b.add_accessor(numbers, 5123, "SCALAR", corners) : -1;
    b.json["nodes"] = {{{"mesh", b.add_mesh(vertices, indices, mode)}}};
    b.json["scenes"] = {{{"nodes", {0}}}};
    return folder.write("a.gltf", b.embedded());
  };
  const auto triangles = [&](int mode, bool indexed) { return load(file(mode, indexed, mode == 4 ? 6 : 5)).triangles; };
  CHECK(triangles(4, false) == Triangles{{0, 1, 2}, {3, 4, 5}});
  CHECK(triangles(4, true) == Triangles{{4, 3, 2}, {1, 0, 5}});
  CHECK(triangles(5, false) == Triangles{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}});
  CHECK(triangles(5, true) == Triangles{{4, 3, 2}, {3, 1, 2}, {2, 1, 0}});
  CHECK(triangles(6, false) == Triangles{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}});
  CHECK(triangles(6, true) == Triangles{{3, 2, 4}, {2, 1, 4}, {1, 0, 4}});
  for (const int mode : {0, 1, 2, 3}) CHECK(triangles(mode, false).empty());
  for (const bool indexed : {false, true}) {
    for (const std::size_t corners : {1u, 2u, 4u, 5u})
      CHECK_THAT(refusal(file(4, indexed, corners)),
                 Contains("mesh 0, primitive 0") && Contains(std::to_string(corners)) && Contains("multiple of 3"));
    for (const int mode : {5, 6})
      CHECK_THAT(refusal(file(mode, indexed, 2)), Contains("mesh 0, primitive 0") && Contains("at least 3"));
  }
}

TEST_CASE("glTF: every component type of positions and indices") {
  const TempFolder folder;
  const auto positions_of = [&](GltfBuilder& b, int accessor) {
    b.json["nodes"] = {{{"mesh", b.add_mesh(accessor)}}};
    b.json["scenes"] = {{{"nodes", {0}}}};
    return load(folder.write("a.gltf", b.embedded())).positions;
  };
  GltfBuilder bytes;
  CHECK(positions_of(bytes, bytes.add_accessor<std::int8_t>({0, 0, 0, 1, -2, 127, 3, 4, 5}, 5120, "VEC3", 3)) ==
        Positions{{0, 0, 0}, {1, -2, 127}, {3, 4, 5}});
  GltfBuilder normalized;
  const int accessor = normalized.add_accessor<std::int16_t>({32767, -32768, 0, 0, 0, 0, 0, 0, 0}, 5122, "VEC3", 3);
  normalized.json["accessors"][0]["normalized"] = true;
  CHECK(positions_of(normalized, accessor) == Positions{{1, -1, 0}, {0, 0, 0}, {0, 0, 0}});
  GltfBuilder unsigned_shorts;
  CHECK(positions_of(unsigned_shorts,
                     unsigned_shorts.add_accessor<std::uint16_t>({65535, 1, 0, 2, 3, 4, 5, 6, 7}, 5123, "VEC3", 3)) ==
        Positions{{65535, 1, 0}, {2, 3, 4}, {5, 6, 7}});
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
  CHECK_THAT(message("accessors", "count", 4), Contains("mesh 0, primitive 0: accessor 0") && Contains("36 bytes"));
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
  b.json["extensionsRequired"] = {"ACME_triangles"};
  CHECK_THAT(refusal(folder.write("bad.gltf", b.embedded())), Contains("ACME_triangles"));
  b.json["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_materials_unlit"};
  CHECK(load(folder.write("good.gltf", b.embedded())).triangles.size() == 1);
}

TEST_CASE("glTF: JSON nested too deeply is refused, in text and in GLB") {
  const TempFolder folder;
  const auto nested = [](const GltfBuilder& b, std::size_t levels, bool glb) {
    GltfBuilder changed = b;
    changed.json["extras"] = "@";
    std::string file = glb ? changed.glb() : changed.embedded();
    const std::string deep = std::string(levels, '[') + std::string(levels, ']');
    file.replace(file.find("\"@\""), 3, deep);
    if (!glb) return file;
    const auto grown = static_cast<std::uint32_t>(deep.size() - 3 + 3) / 4 * 4;
    file.insert(file.find(deep) + deep.size(), grown - (deep.size() - 3), ' ');
    std::uint32_t sizes[2];
    std::memcpy(sizes, file.data() + 8, 8);
    for (std::uint32_t& size : sizes) size += grown;
    std::memcpy(file.data() + 8, sizes, 8);
    return file;
  };
  const GltfBuilder b = triangle_file();
  for (const bool glb : {false, true}) {
    const std::string name = glb ? "a.glb" : "a.gltf";
    CHECK(load(folder.write(name, nested(b, 200, glb))).triangles.size() == 1);
    for (const std::size_t levels : {256u, 1000u, 20'000u, 200'000u})
      CHECK_THAT(refusal(folder.write(name, nested(b, levels, glb))), Contains("256 levels") && Contains("byte "));
  }
  GltfBuilder text = triangle_file();
  text.json["extras"] = std::string(1000, '[') + "\\\"" + std::string(1000, '{');
  CHECK(load(folder.write("text.gltf", text.embedded())).triangles.size() == 1);
}

TEST_CASE("glTF: messages stay short and whole UTF-8") {
  const TempFolder folder;
  GltfBuilder b = triangle_file();
  std::string umlauts;
  for (int i = 0; i < 1'000'000; ++i) umlauts += "\xc3\xa4";
  for (const std::string shift : {"", "x"}) {
    for (const std::string& uri : {"data:application/octet-stream;base64," + shift + umlauts, shift + umlauts}) {
      const std::string message = refusal(folder.write("a.gltf", b.with_external_buffer(uri)));
      CHECK(message.size() < folder.path().string().size() + 310);
      CHECK((contains(message, "...") || contains(message, "data URI is empty, damaged")));
      CHECK_NOTHROW(nlohmann::json(message).dump());
    }
    const std::string truncated = R"({"asset": ")" + shift + umlauts;
    CHECK(refusal(folder.write("b.gltf", truncated)).size() < folder.path().string().size() + 310);
  }
}

TEST_CASE("glTF: invalid values of meshes are refused with mesh and primitive") {
  for (const nlohmann::json& wrong : std::vector<nlohmann::json>{-7, -1, 2, 4294967296, 0.5, "0", nullptr})
    CHECK_THAT(refusal_of("/meshes/0/primitives/0/indices", wrong),
               Contains("mesh 0, primitive 0: 'indices'") && Contains("from 0 to 1"));
  CHECK_THAT(refusal_of("/meshes/0/primitives/0/mode", 7), Contains("mesh 0, primitive 0: 'mode'"));
  CHECK_THAT(refusal_of("/meshes/0/primitives/0/attributes", 7), Contains("mesh 0, primitive 0: 'attributes'"));
  CHECK_THAT(refusal_of("/meshes/0/primitives/0/attributes/COLOR_0", "x"), Contains("mesh 0, primitive 0: 'COLOR_0'"));
  CHECK_THAT(refusal_of("/meshes/0/primitives/0", 1), Contains("mesh 0, primitive 0"));
  CHECK_THAT(refusal_of("/meshes/0/primitives", 1), Contains("mesh 0: 'primitives'"));
  CHECK_THAT(refusal_of("/meshes/0", nlohmann::json::object()), Contains("mesh 0: 'primitives'"));
}

TEST_CASE("glTF: invalid values of accessors are refused with the accessor") {
  for (const std::string key : {"bufferView", "byteOffset", "count", "componentType"})
    for (const nlohmann::json& wrong : std::vector<nlohmann::json>{-4, 1.5, "4"})
      CHECK_THAT(refusal_of("/accessors/0/" + key, wrong), Contains("accessor 0: '" + key + "'"));
  CHECK_THAT(refusal_of("/accessors/0/normalized", 1), Contains("accessor 0: 'normalized'"));
  CHECK_THAT(refusal_of("/accessors/0/sparse", 1), Contains("accessor 0: 'sparse'"));
  CHECK_THAT(refusal_of("/accessors/0/sparse", {{"count", -1}}), Contains("accessor 0, sparse: 'count'"));
  CHECK_THAT(refusal_of("/accessors/0/sparse", {{"count", 1}, {"indices", {{"byteOffset", -1}}}}),
             Contains("accessor 0, sparse, indices: 'byteOffset'"));
  for (const std::string key : {"buffer", "byteOffset", "byteLength", "byteStride"})
    for (const nlohmann::json& wrong : std::vector<nlohmann::json>{-4, 1.5, "4"})
      CHECK_THAT(refusal_of("/bufferViews/1/" + key, wrong), Contains("bufferView 1: '" + key + "'"));
}

TEST_CASE("glTF: invalid values of nodes, scenes and extensions are refused with their number") {
  for (const std::string key : {"mesh", "skin"})
    for (const nlohmann::json& wrong : std::vector<nlohmann::json>{-1, "0", 4294967296})
      CHECK_THAT(refusal_of("/nodes/0/" + key, wrong), Contains("node 0: '" + key + "'"));
  CHECK_THAT(refusal_of("/nodes/0/children", {0, "1"}), Contains("node 0: 'children'"));
  CHECK_THAT(refusal_of("/nodes/0/children", 1), Contains("node 0: 'children'"));
  CHECK_THAT(refusal_of("/nodes", nlohmann::json::object()), Contains("'nodes'"));
  CHECK_THAT(refusal_of("/scenes/0/nodes", {"0"}), Contains("scene 0: 'nodes'"));
  CHECK_THAT(refusal_of("/scene", -1), Contains("'scene'"));
  CHECK_THAT(refusal_of("/extensionsRequired", "KHR_draco_mesh_compression"), Contains("'extensionsRequired'"));
}

TEST_CASE("glTF: broken transforms are refused; rotations are normalised") {
  const TempFolder folder;
  const auto file = [&](const std::string& key, const nlohmann::json& value) {
    GltfBuilder b = triangle_file();
    b.json["nodes"][0][key] = value;
    return folder.write("a.gltf", b.embedded());
  };
  using nlohmann::json;
  for (const auto& [key, size] : std::vector<std::pair<std::string, std::size_t>>{
           {"translation", 3}, {"scale", 3}, {"rotation", 4}, {"matrix", 16}}) {
    const json right(size, 0.5);
    json text = right, missing = right, more = right, null = right;
    text[1] = "1";
    missing.erase(0);
    more.push_back(1);
    null[2] = nullptr;
    for (const json& wrong : {text, missing, more, null, json(1), json::array(), json("x")})
      CHECK_THAT(refusal(file(key, wrong)), Contains("node 0: '" + key + "'") && Contains(std::to_string(size)));
    load(file(key, right));
  }
  for (const json& wrong : {json{0, 0, 0, 0}, json{0, 0, 0, 1.01}, json{0, 0, 0, 0.99}, json{0, 0, 1, 1}})
    CHECK_THAT(refusal(file("rotation", wrong)), Contains("node 0: ") && Contains("length"));
  const double h = std::sqrt(0.5) * 1.0009;
  check_near(load(file("rotation", {0, 0, h, h})).positions[1], {0, 1, 0});
}

TEST_CASE("glTF: only version 2 is read") {
  const TempFolder folder;
  GltfBuilder b = triangle_file();
  for (const nlohmann::json& wrong : std::vector<nlohmann::json>{"1.0", "3.0", "20", "2.x", "", 2, nullptr}) {
    b.json["asset"]["version"] = wrong;
    CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())), Contains("version") && Contains("2."));
  }
  b.json["asset"]["version"] = "2.1";
  b.json["asset"]["minVersion"] = "2.0";
  CHECK(load(folder.write("a.gltf", b.embedded())).triangles.size() == 1);
  b.json["asset"]["minVersion"] = "2.1";
  CHECK_THAT(refusal(folder.write("a.gltf", b.embedded())),
             Contains("the asset needs readers of version \"2.1\" (minVersion), and this one knows \"2.0\""));
  b.json["asset"].erase("minVersion");
  const std::string text = b.embedded();
  CHECK_THAT(refusal(folder.write("a.gltf", text.substr(0, text.size() / 2))),
             Contains("its JSON cannot be read: truncated: parse error at line 1"));
  std::string glb = b.glb();
  for (const char version : {'\0', '\1', '\3'}) {
    glb[4] = version;
    CHECK_THAT(refusal(folder.write("a.glb", glb)), Contains("version " + std::to_string(version)) && Contains("2"));
  }
}

TEST_CASE("glTF: buffers that are not regular files are refused") {
  const TempFolder folder;
  const GltfBuilder b = triangle_file();
  REQUIRE(mkfifo((folder / "fifo").c_str(), 0600) == 0);
  std::filesystem::create_directory(folder / "folder");
  for (const std::string uri : {"fifo", "folder"}) {
    INFO(uri);
    CHECK_THAT(refusal(folder.write("a.gltf", b.with_external_buffer(uri))),
               Contains(uri) && Contains("is not a regular file"));
  }
}
