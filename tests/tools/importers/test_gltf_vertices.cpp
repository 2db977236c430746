/// Texture coordinates and normals of glTF files.

#include <tests/tools/built_inputs.h>

#include <tests/oracle/random.h>

#include <array>
#include <cmath>
#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;
using nlohmann::json;

namespace {

using Normal = std::array<float, 3>;
using Coordinates = std::vector<std::array<float, 2>>;

const std::vector<float> kTriangle{0, 0, 0, 1, 0, 0, 0, 1, 0};

GltfBuilder triangle() {
  GltfBuilder b;
  b.add_mesh(b.add_positions(kTriangle));
  b.json["nodes"] = {{{"mesh", 0}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  return b;
}

/// One triangle with an attribute.
template <class T>
GltfBuilder with_attribute(const char* name, const std::vector<T>& values, int component_type, const char* type,
                           bool normalized) {
  GltfBuilder b = triangle();
  const std::size_t components = std::string(type) == "VEC2" ? 2 : 3;
  const int accessor = b.add_accessor(values, component_type, type, values.size() / components);
  b.json["accessors"].back()["normalized"] = normalized;
  b.json["meshes"][0]["primitives"][0]["attributes"][name] = accessor;
  return b;
}

tools::GeometrySurface surface_of(const GltfBuilder& b) {
  const TempFolder folder;
  return surfaces_of(folder, b).objects.at(0).at(0);
}

std::string fault(const GltfBuilder& b) {
  const TempFolder folder;
  return surface_fault(folder, b);
}

double dot(const Normal& a, const Normal& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return sum;
}

/// Of the triangle of three corners, unit.
Normal facing(const std::vector<build::Position>& positions, const build::Triangle& t) {
  std::array<double, 3> a{}, b{};
  for (std::size_t i = 0; i < 3; ++i) {
    a[i] = static_cast<double>(positions[t[1]][i]) - static_cast<double>(positions[t[0]][i]);
    b[i] = static_cast<double>(positions[t[2]][i]) - static_cast<double>(positions[t[0]][i]);
  }
  const std::array<double, 3> n{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  const double length = std::hypot(n[0], n[1], n[2]);
  return {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)};
}

}  // namespace

TEST_CASE("vertices: texture coordinates of every type") {
  const auto read = [](const auto& values, int type, bool normalized) {
    return surface_of(with_attribute("TEXCOORD_0", values, type, "VEC2", normalized)).coordinates;
  };
  CHECK(read(std::vector<float>{0, 0.5f, -1, 2, 3, 0.25f}, 5126, false) == Coordinates{{0, 0.5f}, {-1, 2}, {3, 0.25f}});
  CHECK(read(std::vector<std::uint8_t>{0, 255, 51, 102, 0, 0}, 5121, true) ==
        Coordinates{{0, 1}, {51 / 255.0f, 102 / 255.0f}, {0, 0}});
  CHECK(read(std::vector<std::uint16_t>{0, 65535, 13107, 0, 0, 0}, 5123, true) ==
        Coordinates{{0, 1}, {13107 / 65535.0f, 0}, {0, 0}});
  CHECK(read(std::vector<std::int16_t>{-3, 7, 0, 0, 0, 0}, 5122, false) == Coordinates{{-3, 7}, {0, 0}, {0, 0}});
}

TEST_CASE("vertices: sparse texture coordinates") {
  GltfBuilder b = with_attribute<float>("TEXCOORD_0", {1, 2, 3, 4, 5, 6}, 5126, "VEC2", false);
  const int where = b.add_view<std::uint8_t>({1}), what = b.add_view<float>({8, 9});
  b.json["accessors"].back()["sparse"] = {
      {"count", 1}, {"indices", {{"bufferView", where}, {"componentType", 5121}}}, {"values", {{"bufferView", what}}}};
  CHECK(surface_of(b).coordinates == Coordinates{{1, 2}, {8, 9}, {5, 6}});
}

TEST_CASE("vertices: normals are normalised; invalid normals become 0") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto normals =
      surface_of(with_attribute<float>("NORMAL", {0, 3, 4, 0, 0, 0, nan, 0, 1}, 5126, "VEC3", false)).normals;
  REQUIRE(normals.size() == 3);
  CHECK(normals[0] == Normal{0, 0.6f, 0.8f});
  CHECK(normals[1] == Normal{0, 0, 0});
  CHECK(normals[2] == Normal{0, 0, 0});
  const auto bytes =
      surface_of(with_attribute<std::int8_t>("NORMAL", {0, 127, 0, -128, 0, 0, 0, 0, 127}, 5120, "VEC3", true)).normals;
  CHECK(bytes == std::vector<Normal>{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}});
}

TEST_CASE("vertices: primitives with and without attributes in one mesh") {
  GltfBuilder b = triangle();
  json& primitives = b.json["meshes"][0]["primitives"];
  for (int i = 0; i < 2; ++i) primitives.push_back(primitives[0]);
  primitives[1]["attributes"]["TEXCOORD_0"] = b.add_accessor<float>({1, 2, 3, 4, 5, 6}, 5126, "VEC2", 3);
  primitives[2]["attributes"]["NORMAL"] = b.add_positions({0, 0, 1, 0, 0, 1, 0, 0, 1});
  const auto surface = surface_of(b);
  CHECK(surface.coordinates == Coordinates{{0, 0}, {0, 0}, {0, 0}, {1, 2}, {3, 4}, {5, 6}, {0, 0}, {0, 0}, {0, 0}});
  REQUIRE(surface.normals.size() == 9);
  CHECK(surface.normals[5] == Normal{0, 0, 0});
  CHECK(surface.normals[6] == Normal{0, 0, 1});
  CHECK(surface_of(triangle()).coordinates.empty());
  CHECK(surface_of(triangle()).normals.empty());
}

TEST_CASE("vertices: wrong attributes are refused with the primitive and the attribute") {
  const std::string where = "mesh 0, primitive 0: ";
  CHECK_THAT(fault(with_attribute<float>("TEXCOORD_0", {1, 2, 3, 4}, 5126, "VEC2", false)),
             Contains(where + "TEXCOORD_0 has 2 elements, but POSITION has 3"));
  CHECK_THAT(fault(with_attribute<float>("NORMAL", {1, 2, 3}, 5126, "VEC3", false)),
             Contains(where + "NORMAL has 1 elements, but POSITION has 3"));
  CHECK_THAT(fault(with_attribute<float>("TEXCOORD_0", {1, 2, 3, 4, 5, 6, 7, 8, 9}, 5126, "VEC3", false)),
             Contains(where + "TEXCOORD_0: accessor 1: it is not of type VEC2"));
  const float inf = std::numeric_limits<float>::infinity();
  CHECK_THAT(fault(with_attribute<float>("TEXCOORD_0", {1, 2, 3, inf, 5, 6}, 5126, "VEC2", false)),
             Contains(where + "TEXCOORD_0: vertex 1 has coordinates that are not finite"));
  GltfBuilder b = triangle();
  b.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 9;
  CHECK_THAT(fault(b), Contains(where + "NORMAL: accessor 9: it does not exist"));
}

TEST_CASE("vertices: normals are perpendicular to transformed surfaces, mirrored or not") {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    INFO("seed " << seed);
    oracle::Random random(seed);
    std::vector<float> positions(9);
    for (float& position : positions) position = random.uniform_float(-1, 1);
    GltfBuilder b;
    b.add_mesh(b.add_positions(positions));
    const Normal local = facing({{positions[0], positions[1], positions[2]},
                                 {positions[3], positions[4], positions[5]},
                                 {positions[6], positions[7], positions[8]}},
                                {0, 1, 2});
    std::vector<float> normals;
    for (int i = 0; i < 3; ++i) normals.insert(normals.end(), local.begin(), local.end());
    b.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = b.add_positions(normals);
    std::vector<double> matrix(16);
    for (int i = 0; i < 16; ++i) matrix[static_cast<std::size_t>(i)] = i % 4 == 3 ? i == 15 : random.uniform(-2, 2);
    b.json["nodes"] = {{{"matrix", matrix}, {"children", {1}}}, {{"mesh", 0}, {"scale", {3, 0.25, 2}}}};
    b.json["scenes"] = {{{"nodes", {0}}}};
    const TempFolder folder;
    tools::BuildCommand command;
    command.inputs = {folder.write("a.glb", b.glb()).string()};
    const auto mesh = value_of(tools::load_mesh(command.inputs[0]));
    for (const bool flatten : {false, true}) {
      command.instances = command.flatten = flatten;
      const auto surface = surfaces_of(command).objects.at(0).at(0);
      REQUIRE(surface.triangles == mesh.triangles);
      const Normal expected = facing(mesh.positions, mesh.triangles[0]);
      for (const Normal& normal : surface.normals) {
        CHECK(dot(normal, normal) == Approx(1).epsilon(1e-6));
        CHECK(dot(normal, expected) > 0.99999);
      }
    }
    command.instances = true;
    command.flatten = false;
    const auto object = surfaces_of(command).objects.at(0).at(0);
    for (const Normal& normal : object.normals) CHECK(dot(normal, local) > 0.999999);
  }
}

TEST_CASE("vertices: normals where a node makes a mesh flat or nearly a point") {
  GltfBuilder b = with_attribute<float>("NORMAL", {0, 0, 1, 0, 1, 1, 1, 0, 0}, 5126, "VEC3", false);
  b.json["nodes"][0]["scale"] = {2, 3, 0};
  CHECK(surface_of(b).normals == std::vector<Normal>{{0, 0, 1}, {0, 0, 1}, {0, 0, 0}});
  b.json["nodes"][0]["scale"] = {1e-30, 1e-30, 1e-30};
  CHECK(surface_of(b).normals[0] == Normal{0, 0, 1});
}
