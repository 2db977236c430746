/// Files of strands and spheres: reading them, and the error messages.

#include "hair_files.h"

#include <tools/scene_io/shapes/shape_import.h>

#include <tests/catch.h>

#include <limits>

using namespace hiprt;
using namespace hiprt::test;
using tools::ShapeSet;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

ShapeSet read(const std::string& name, const std::string& bytes) {
  const TempFolder folder;
  auto shapes = tools::load_shapes(folder.write(name, bytes));
  if (!shapes) FAIL(shapes.error().message);
  return std::move(*shapes);
}

/// The error message after the file's path.
std::string fault(const std::string& name, const std::string& bytes) {
  const TempFolder folder;
  const std::string path = folder.write(name, bytes);
  const auto shapes = tools::load_shapes(path);
  if (shapes) FAIL("accepted");
  CHECK(shapes.error().code == build::ErrorCode::kInvalidInput);
  REQUIRE(shapes.error().message.starts_with(path + ": "));
  return shapes.error().message.substr(path.size() + 2);
}

std::string hair_fault(const HairFile& file) { return fault("a.hair", file.bytes()); }

}  // namespace

TEST_CASE("hair files: strands of any number of segments, radii half the thickness") {
  const ShapeSet hair = read("wig.HAIR", HairFile{}.bytes());
  CHECK(hair.name == "wig.HAIR");
  CHECK(hair.kind == ShapeKind::kCurves);
  CHECK(hair.strands == 2);
  REQUIRE(hair.points.size() == 5);
  CHECK(hair.points[0].radius == 0.25f);
  CHECK(hair.points[2].position[1] == 0.5f);
  CHECK(hair.points[2].radius == 0);
  CHECK(hair.points[4].position[2] == 1);
  CHECK(hair.segments == std::vector<std::uint32_t>{0, 1, 3});
}

TEST_CASE("hair files: defaults in place of arrays, and arrays that are skipped") {
  HairFile file;
  file.arrays = 2;
  file.default_segments = 4;
  file.strands = 1;
  file.default_thickness = 3;
  const ShapeSet defaults = read("a.hair", file.bytes());
  CHECK(defaults.segments == std::vector<std::uint32_t>{0, 1, 2, 3});
  CHECK(defaults.points[4].radius == 1.5f);

  HairFile colored;
  colored.arrays |= 8 | 16;
  colored.more.assign(5 * 16, '\x7f');
  CHECK(read("a.hair", colored.bytes()).points[3].radius == 0.5f);
  CHECK(defaults.warnings.empty());
  CHECK(read("a.hair", colored.bytes()).warnings ==
        std::vector<std::string>{"ignored: transparencies of points (5), colours of points (5)"});
  CHECK(read("a.hair", HairFile{}.bytes() + "more").warnings ==
        std::vector<std::string>{"ignored: bytes behind the last array (4)"});
  colored.more.pop_back();
  CHECK(hair_fault(colored) == "truncated: 291 bytes, its 2 strands and 5 points take 292");
}

TEST_CASE("hair files: a strand of one point has no segment, and a file may have no strands") {
  HairFile file;
  file.segments = {0, 3};
  CHECK(read("a.hair", file.bytes()).segments == std::vector<std::uint32_t>{1, 2, 3});
  HairFile empty;
  empty.strands = empty.points = 0;
  empty.segments.clear();
  empty.positions.clear();
  empty.thickness.clear();
  CHECK(read("a.hair", empty.bytes()).size() == 0);
}

TEST_CASE("hair files: truncated files are refused") {
  const std::string whole = HairFile{}.bytes();
  for (std::size_t size = 1; size < whole.size(); ++size) {
    INFO(size);
    const std::string said = fault("a.hair", whole.substr(0, size));
    CHECK(said.starts_with("truncated: " + std::to_string(size) + " bytes, "));
  }
}

TEST_CASE("hair files: counts that do not match, and numbers that are not finite") {
  HairFile file;
  file.magic = "HAIL";
  CHECK(hair_fault(file) == "does not start with 'HAIR'");
  file = {};
  file.arrays = 1 | 4;
  CHECK(hair_fault(file) == "has no array of points (bit 1 at byte 12)");
  file.arrays = 7 | 32;
  CHECK(hair_fault(file) == "the arrays at byte 12 are 39, known are bits 0 to 4");
  file = {};
  file.strands = file.points = 0xffffffffu;
  CHECK(hair_fault(file) == "truncated: 212 bytes, its 4294967295 strands and 4294967295 points take 77309411438");
  file = {};
  file.segments = {3, 1};
  CHECK(hair_fault(file) == "strand 1 ends at point 6, but the header says 5 points");
  file.segments = {1, 1};
  CHECK(hair_fault(file) == "the strands have 4 points, but the header says 5");
  file = {};
  file.arrays = 2 | 4;
  file.default_segments = 0xffffffffu;
  CHECK(hair_fault(file) == "strand 0 ends at point 4294967296, but the header says 5 points");
  file = {};
  file.thickness[4] = -2;
  CHECK(hair_fault(file) == "strand 1, point 1: radius -1");
  file.positions[5] = kNan;
  CHECK(hair_fault(file) == "strand 0, point 1: z is nan");
}

TEST_CASE("hair files are read as they are written") {
  const std::vector<std::uint32_t> strands{2, 1, 3};
  std::vector<ShapePoint> points;
  for (unsigned i = 0; i < 6; ++i) {
    const auto x = static_cast<float>(i);
    points.push_back({{x, x / 3, -x}, 0.1f * x});
  }
  const auto bytes = tools::hair_file(strands, points, std::string(200, 'x'));
  const ShapeSet hair = read("a.hair", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  REQUIRE(hair.points.size() == points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(std::equal(points[i].position, points[i].position + 3, hair.points[i].position));
    CHECK(hair.points[i].radius == points[i].radius);
  }
  CHECK(hair.segments == std::vector<std::uint32_t>{0, 3, 4});
}

TEST_CASE("xyzr files: a sphere per line") {
  const ShapeSet spheres = read("atoms.xyzr", "# atoms\n\n 1 2 3 0.5 # carbon\r\n-1e1\t+2 .5 0\r1 1 1 1");
  CHECK(spheres.kind == ShapeKind::kSpheres);
  REQUIRE(spheres.points.size() == 3);
  CHECK(spheres.points[0].position[2] == 3);
  CHECK(spheres.points[1].position[0] == -10);
  CHECK(spheres.points[1].radius == 0);
  CHECK(spheres.segments.empty());
  CHECK(read("a.xyzr", "#\n").size() == 0);
}

TEST_CASE("xyzr files: errors are reported with the line") {
  CHECK(fault("a.xyzr", "1 2 3 4\n\n1 2 3\n") == "line 3: 3 numbers, 4 expected");
  CHECK(fault("a.xyzr", "1 2 3 4 5") == "line 1: 5 numbers, 4 expected");
  CHECK(fault("a.xyzr", "1 2 3 4\n1 two 3 4") == "line 2: 'two' is not a number");
  CHECK(fault("a.xyzr", "1 2 3 -4") == "line 1: radius -4");
  CHECK(fault("a.xyzr", "1 nan 3 4") == "line 1: y is nan");
  CHECK(fault("a.xyzr", "1 2 3 1e99") == "line 1: radius inf");
}

TEST_CASE("shape files are recognised by their names") {
  CHECK(tools::is_shape_file("a/b.hair"));
  CHECK(tools::is_shape_file("B.XYZR"));
  CHECK_FALSE(tools::is_shape_file("hair"));
  CHECK_FALSE(tools::is_shape_file("a.hair.obj"));
  const auto missing = tools::load_shapes("/nowhere/a.hair");
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == build::ErrorCode::kIo);
}
