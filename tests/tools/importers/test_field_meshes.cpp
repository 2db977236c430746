/// Mesh files as other programs write them: not as their formats say, but meant clearly.

#include <tests/tools/load.h>

#include <tools/base/text.h>
#include <tools/scene_io/shapes/shape_import.h>
#include <tools/scene_io/surface/material_library.h>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

const Positions kSquare{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const Triangles kTwo{{0, 1, 2}, {0, 2, 3}};
const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string ply(const std::string& list = "property list uchar int vertex_indices", const std::string& version = "1.0",
                const std::string& format = "ascii") {
  return "ply\nformat " + format + " " + version +
         "\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n" + list +
         "\nend_header\n";
}
const std::string kBody = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

void check_square(const tools::Mesh& mesh, const std::vector<std::string>& warnings = {}) {
  CHECK(mesh.positions == kSquare);
  CHECK(mesh.triangles == kTwo);
  CHECK(mesh.warnings == warnings);
}

std::string facet(const std::string& a, const std::string& b, const std::string& c) {
  return "facet normal 0 0 1\nouter loop\nvertex " + a + "\nvertex " + b + "\nvertex " + c + "\nendloop\nendfacet\n";
}
const std::string kSolid = "solid a\n" + facet("0 0 0", "1 0 0", "1 1 0") + facet("0 0 0", "1 1 0", "0 1 0");

std::string utf16(const std::string& text, bool big, bool mark) {
  std::string result = !mark ? "" : big ? "\xfe\xff" : "\xff\xfe";
  for (const char c : text) result += big ? std::string{'\0', c} : std::string{c, '\0'};
  return result;
}

}  // namespace

TEST_CASE("PLY of others: int64 and uint64, real list lengths and numbers, versions 1.x") {
  const TempFolder folder;
  for (const std::string list : {"uint8 int64", "int64 uint64", "float float", "double double", "float uchar"})
    check_square(load(folder.write("a.ply", ply("property list " + list + " vertex_indices") + kBody)));
  for (const std::string version : {"1.0", "1.1", "1.9"})
    check_square(load(folder.write("a.ply", ply("property list uchar int vertex_indices", version) + kBody)));
  for (const bool big : {false, true}) {
    std::string bytes;
    const auto put = [&](auto value) {
      std::string raw;
      append(raw, value);
      if (big) std::reverse(raw.begin(), raw.end());
      bytes += raw;
    };
    for (const auto& position : kSquare)
      for (const float x : position) put(x);
    put(4.0f);
    for (const std::int64_t corner : {0, 1, 2, 3}) put(corner);
    const std::string format = big ? "binary_big_endian" : "binary_little_endian";
    const std::string head = ply("property list float int64 vertex_indices", "1.0", format);
    check_square(load(folder.write("a.ply", head + bytes)));
    check_square(load(folder.write("a.ply", head + bytes + "garbage")), {"ignored: bytes behind the last element (7)"});
  }
  CHECK_THAT(refusal(folder.write(
                 "a.ply", ply("property list float int vertex_indices") + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n2.5 0 1 2 3\n")),
             Contains("list cannot have 2.5"));
  CHECK_THAT(refusal(folder.write("a.ply", ply("property list uchar float vertex_indices") +
                                               "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 2.5\n")),
             Contains("vertex number 2.5"));
}

TEST_CASE("PLY of others: unknown header lines, other elements and data behind the last element are named") {
  const TempFolder folder;
  std::string text = ply() + kBody;
  check_square(load(folder.write("a.ply", text + "\n \n")));
  check_square(load(folder.write("a.ply", text + "1 2 3\n")), {"ignored: bytes behind the last element (6)"});
  text.replace(text.find("element vertex"), 0, "made by hand\nTextureFile a.png\n");
  text.replace(text.find("end_header"), 0, "element edge 2\nproperty int a\n");
  check_square(load(folder.write("a.ply", text + "7 8\n")),
               {"ignored: elements 'edge' (2), header lines with unknown keywords (2)"});
}

TEST_CASE("PLY of others: triangle strips, with -1 between them") {
  const TempFolder folder;
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 2\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n2 1 0\n";
  const auto triangles = [&](const std::string& strips) {
    return load(folder.write("a.ply", head + strips)).triangles;
  };
  // The second and fourth triangle of a strip are turned around: all look the same way.
  CHECK(triangles("6 0 1 2 3 4 5\n0\n") == Triangles{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 5}});
  CHECK(triangles("10 0 1 2 -1 -1 2 3 4 5 -1\n3 5 4 3\n") == Triangles{{0, 1, 2}, {2, 3, 4}, {4, 3, 5}, {5, 4, 3}});
  CHECK(triangles("2 0 1\n1 -1\n").empty());
  CHECK_THAT(refusal(folder.write("a.ply", head + "3 0 1 -2\n0\n")), Contains("tristrips 0") && Contains("-2"));
  CHECK_THAT(refusal(folder.write("a.ply", head + "3 0 1 6\n0\n")), Contains("vertex 6"));
}

TEST_CASE("STL of others: no endsolid, bytes behind the last facet, upper case") {
  const TempFolder folder;
  const auto check = [&](const std::string& content, const std::vector<std::string>& warnings) {
    const tools::Mesh mesh = load(folder.write("a.stl", content));
    CHECK(mesh.triangles == Triangles{{0, 1, 2}, {3, 4, 5}});
    CHECK(mesh.positions == Positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    CHECK(mesh.warnings == warnings);
  };
  const std::string no_end = "the last solid has no 'endsolid': is the file whole?";
  check(kSolid + "endsolid a\n", {});
  check(kSolid, {no_end});
  check(kSolid + "endsolid a\nmade by x\n", {"ignored: bytes behind the last facet (10)"});
  check(kSolid + "ends", {"ignored: bytes behind the last facet (4)", no_end});
  check(kSolid + "endsolid a\n" + std::string(5, '\0'), {"ignored: bytes behind the last facet (5)"});
  std::string bytes(80, ' ');
  append(bytes, 2u);
  for (const unsigned half : {0u, 1u}) {
    append(bytes, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f);
    for (const build::Position& p : {kSquare[1 + half], kSquare[2 + half]}) append(bytes, p[0], p[1], p[2]);
    append(bytes, std::uint16_t{0});
  }
  check(bytes, {});
  check(bytes + "xy", {"ignored: bytes behind the last facet (2)"});
}

TEST_CASE("OBJ of others: comments at the end of a word, numbers that are none, statements without triangles") {
  const TempFolder folder;
  check_square(load(folder.write("a.obj", "# C:\\models\\\n" + kVertices + "f 1 2 3 # C:\\\nf 1 \\\n3 4\n")));
  check_square(load(folder.write("a.obj", "v 0 0 0#a\nv 1 0 0 # b\nv 1 1 0\nv 0 1 0\nf 1 2 3#c\nf 1 3 4#comment\n")));
  const tools::Mesh mesh = load(
      folder.write("a.obj", "v 1.#IND 1.#INF -1.#INF00\nv -1.#IND00 1.#QNAN0 nan(ind)\nv 1.#J 0 0.5#rest\nf 1 2 3\n"));
  const float inf = std::numeric_limits<float>::infinity();
  REQUIRE(mesh.positions.size() == 3);
  CHECK(std::isnan(mesh.positions[0][0]));
  CHECK((mesh.positions[0][1] == inf && mesh.positions[0][2] == -inf));
  for (const float x : mesh.positions[1]) CHECK(std::isnan(x));
  CHECK((std::isnan(mesh.positions[2][0]) && mesh.positions[2][1] == 0 && mesh.positions[2][2] == 0.5f));
  CHECK_THAT(refusal(folder.write("a.obj", "v 1.#WHAT 0 0\n")), Contains("fewer than three"));
  const std::string more = "l 1 2\nl 2 3\np 1\nsurf 0 1 0 1 1 2\nvt 0 0\nvn 0 0 1\nusemtl red\ns 1\nfrom outer space\n";
  check_square(load(folder.write("a.obj", kVertices + more + "f 1 2 3 4\n")),
               {"ignored: lines (2), points (1), free-form surfaces (1), lines with unknown keywords (1)"});
  check_square(load(folder.write("a.obj", "v 0 0 0 2\nv 1 0 0 1\nv 1 1 0 1.0\nv 0 1 0 .5 .5 .5\nf 1 2 3 4\n")),
               {"ignored: weights (w) of vertices (1)"});
}

TEST_CASE("OBJ and PLY: materials and colours are named if they are asked for") {
  const TempFolder folder;
  tools::MaterialLibrary library;
  const std::string obj = folder.write("a.obj", kVertices + "usemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n");
  CHECK(load(obj).warnings.empty());
  CHECK(tools::load_mesh(obj, &library)->warnings == std::vector<std::string>{"ignored: uses of materials (2)"});
  std::string text = ply() + kBody;
  text.replace(text.find("property float x"), 0, "property uchar red\n");
  for (const std::string row : {"\n0 0 0", "\n1 0 0", "\n1 1 0", "\n0 1 0"}) text.insert(text.find(row) + 1, "255 ");
  const std::string path = folder.write("a.ply", text);
  check_square(load(path));
  CHECK(tools::load_mesh(path, &library)->warnings == std::vector<std::string>{"ignored: colours of vertices (4)"});
  const std::string shaded =
      folder.write("b.obj", "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 .5 0 0\nv 0 1 0\nvn 0 0 1\nf 1 2 3 4\n");
  CHECK(load(shaded).warnings.empty());
  CHECK(tools::load_mesh(shaded, &library)->warnings ==
        std::vector<std::string>{"ignored: colours of vertices (3), normals (1)"});
  for (const auto& [property, kind] : {std::pair{"nx", "normals of vertices"},
                                       {"diffuse_red", "colours of vertices"},
                                       {"texture_u", "texture coordinates of vertices"}}) {
    std::string named = text;
    named.replace(named.find("uchar red"), 9, std::string("uchar ") + property);
    CHECK(tools::load_mesh(folder.write("c.ply", named), &library)->warnings ==
          std::vector<std::string>{std::string("ignored: ") + kind + " (4)"});
  }
}

TEST_CASE("Texts: numbers of Microsoft's library in PLY, STL and spheres") {
  const TempFolder folder;
  std::string text = ply() + kBody;
  CHECK(std::isnan(load(folder.write("a.ply", text.replace(text.rfind("0 1 0"), 1, "-1.#IND"))).positions[3][0]));
  text = kSolid + "endsolid\n";
  CHECK(std::isnan(load(folder.write("a.stl", text.replace(text.rfind("0 1 0"), 1, "1.#QNAN"))).positions[5][0]));
  const auto shapes = tools::load_shapes(folder.write("a.xyzr", "0 0 0 1.#IND\n"));
  REQUIRE_FALSE(shapes);
  CHECK_THAT(shapes.error().message, Contains("line 1: radius nan"));
  CHECK(tools::load_shapes(folder.write("a.xyzr", "0 0 0 1# one\n"))->points.size() == 1);
  CHECK(tools::without_comment("1.#IND 2#3") == "1.#IND 2");
  CHECK(tools::without_comment("0.#IND") == "0.");
}

TEST_CASE("Texts: UTF-16 is named in the error") {
  const TempFolder folder;
  for (const bool big : {false, true})
    for (const bool mark : {false, true}) {
      for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
               {"a.obj", kVertices + "f 1 2 3 4\n"}, {"a.ply", ply() + kBody}, {"a.stl", kSolid + "endsolid\n"}})
        CHECK_THAT(refusal(folder.write(name, utf16(text, big, mark))), Contains("UTF-16") && Contains("save it as"));
      CHECK_THAT(refusal(folder.write("a.gltf", utf16("{\"asset\": {}}", big, mark))), Contains("UTF-16"));
      const auto shapes = tools::load_shapes(folder.write("a.xyzr", utf16("0 0 0 1\n", big, mark)));
      REQUIRE_FALSE(shapes);
      CHECK_THAT(shapes.error().message, Contains("UTF-16"));
    }
}
