#include <tests/tools/load.h>

#include <tools/scene_io/mesh/polygons.h>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

TEST_CASE("OBJ: objects, groups, indices of every form, comments and continued lines are one mesh in file order") {
  const TempFolder folder;
  const auto path = folder.write("a.OBJ",
                                 "# a comment\r\nmtllib none.mtl\no one\nv 0 0 0\r\nv 1 0 0 1.0\nv 0 1 0 0.5 0.5 0.5\n"
                                 "vn 0 0 1\nvt 0 0\nusemtl red\nf 1 2 3\ng two\n  v 0 0 1\nf 1/1 2/1 4/1 # mixed\n"
                                 "f 1//1 \\\n  3//1 4//1\ns off\nf -1/1/1 -2/1/1 -3/1/1\nl 1 2\n");
  const tools::Mesh mesh = load(path);
  CHECK(mesh.name == "a.OBJ");
  CHECK(mesh.positions == Positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  CHECK(mesh.triangles == Triangles{{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {3, 2, 1}});
  CHECK(mesh.skipped_faces == 0);
}

TEST_CASE("OBJ: faces may come before their vertices") {
  const TempFolder folder;
  CHECK(load(folder.write("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0")).triangles == Triangles{{0, 1, 2}});
}

TEST_CASE("OBJ: lines end with LF, CRLF or CR; a byte order mark is skipped") {
  const TempFolder folder;
  for (const std::string end : {"\n", "\r\n", "\r"})
    for (const std::string mark : {"", "\xef\xbb\xbf"}) {
      const std::string text = mark + "v 0 0 0" + end + "v 1 0 0" + end + end + "v 0 1 0" + end + "v 5 5 5" + end;
      const auto mesh = load(folder.write("a.obj", text + "f 1 2 \\" + end + " 3" + end));
      CHECK(mesh.positions == Positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}});
      CHECK(mesh.triangles == Triangles{{0, 1, 2}});
      CHECK_THAT(refusal(folder.write("bad.obj", text + "f 1 2 9" + end)), Contains("line 6"));
    }
}

TEST_CASE("OBJ: numbers are rounded correctly; NaN, infinity, degenerate and thin faces are kept") {
  const TempFolder folder;
  const auto mesh = load(folder.write("a.obj",
                                      "v 0.1 1e-40 3.4028234663852886e38\nv nan -inf +Infinity\nv 1e39 -1e-50 +2.5\n"
                                      "v 16777217.0000001 0 0\nf 1 1 2\nf 1 2 3\nf 4 4 4\nf 1 2\n"));
  REQUIRE(mesh.positions.size() == 4);
  CHECK(mesh.positions[0] == build::Position{0.1f, 1e-40f, std::numeric_limits<float>::max()});
  CHECK(std::isnan(mesh.positions[1][0]));
  CHECK(mesh.positions[1][1] == -std::numeric_limits<float>::infinity());
  CHECK(mesh.positions[1][2] == std::numeric_limits<float>::infinity());
  CHECK(mesh.positions[2] == build::Position{std::numeric_limits<float>::infinity(), 0.0f, 2.5f});
  CHECK(mesh.positions[3][0] == 16777218.0f);
  CHECK(mesh.triangles == Triangles{{0, 0, 1}, {0, 1, 2}, {3, 3, 3}});
  CHECK(mesh.skipped_faces == 1);
}

TEST_CASE("OBJ: wrong content is refused with the line") {
  const TempFolder folder;
  const auto message = [&](const std::string& text) { return refusal(folder.write("bad.obj", text)); };
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  CHECK_THAT(message(three + "f 1 2 4\n"), Contains("line 4") && Contains("vertex 4") && Contains("has 3"));
  CHECK_THAT(message(three + "f 1 2 4294967297\n"), Contains("line 4") && Contains("4294967297"));
  CHECK_THAT(message(three + "f 1 2 99999999999999999999\n"), Contains("line 4") && Contains("99999999999999999999"));
  CHECK_THAT(message(three + "f 1 2 0\n"), Contains("line 4") && Contains("start at 1"));
  CHECK_THAT(message(three + "f 1 2 -4\n"), Contains("line 4") && Contains("only 3"));
  CHECK_THAT(message(three + "f 1 2 x\n"), Contains("line 4") && Contains("'x'"));
  CHECK_THAT(message("v 0 0\n"), Contains("line 1") && Contains("fewer than three"));
  CHECK_THAT(message("v 0 zero 0\n"), Contains("line 1") && Contains("'zero'"));
  CHECK_THAT(message("v 0 1.5.2 0\n"), Contains("'1.5.2'"));
  CHECK_THAT(message("hello world\n"), Contains("not an OBJ file"));
  CHECK_THAT(message(std::string(100, '\0')), Contains("not an OBJ file"));
}

namespace {

double area(const Positions& p, const Triangles& triangles) {
  double sum = 0;
  for (const auto& t : triangles)
    sum += 0.5 * ((double{p[t[1]][0]} - p[t[0]][0]) * (double{p[t[2]][1]} - p[t[0]][1]) -
                  (double{p[t[1]][1]} - p[t[0]][1]) * (double{p[t[2]][0]} - p[t[0]][0]));
  return sum;
}

bool all_counter_clockwise(const Positions& p, const Triangles& triangles) {
  for (const auto& t : triangles)
    if (area(p, {t}) < 0) return false;
  return true;
}

}  // namespace

TEST_CASE("Polygons: convex faces become fans, concave ones keep their area and orientation") {
  std::uint64_t skipped = 0;
  const Positions square{{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}};
  CHECK(*tools::triangulate(square, {{0, 1, 2, 3}, {4}}, skipped) == Triangles{{0, 1, 2}, {0, 2, 3}});
  CHECK(*tools::triangulate(square, {{3, 2, 1, 0}, {4}}, skipped) == Triangles{{3, 2, 1}, {3, 1, 0}});

  const Positions arrow{{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}};  // Concave at corner 2.
  const Triangles split = *tools::triangulate(arrow, {{0, 1, 2, 3}, {4}}, skipped);
  CHECK(split.size() == 2);
  CHECK(all_counter_clockwise(arrow, split));
  CHECK(area(arrow, split) == Approx(4.0));

  Positions star;
  tools::Polygons faces;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const double angle = i * 3.14159265358979 / 20, radius = i % 2 == 0 ? 2.0 : 0.7;
    star.push_back({static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle)), 0});
    faces.corners.push_back(i);
  }
  faces.sizes.push_back(40);
  const Triangles spikes = *tools::triangulate(star, faces, skipped);
  CHECK(spikes.size() == 38);
  CHECK(all_counter_clockwise(star, spikes));
  CHECK(area(star, spikes) == Approx(0.5 * 40 * 2.0 * 0.7 * std::sin(3.14159265358979 / 20)));
  CHECK(skipped == 0);
}

TEST_CASE("Polygons: faces with NaN, in one point or crossing themselves give size - 2 triangles") {
  std::uint64_t skipped = 0;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Positions odd{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}, {nan, nan, nan}};
  CHECK(tools::triangulate(odd, {{0, 1, 2, 3, 4}, {5}}, skipped)->size() == 3);
  CHECK(tools::triangulate(odd, {{0, 0, 0, 0, 0, 0}, {6}}, skipped)->size() == 4);
  CHECK(tools::triangulate(odd, {{0, 1, 2, 3}, {4}}, skipped)->size() == 2);
  CHECK(tools::triangulate(odd, {{0, 1, 0}, {0, 1, 2}}, skipped)->empty());
  CHECK(skipped == 3);
}
