/// bvhrender --mode bvh as a user runs it.

#include "read_images.h"
#include "renderer.h"

#include <hiprt_build/instances.h>

using namespace hiprt;
using namespace hiprt::test;
using Catch::Contains;

namespace {

/// A row of tetrahedra of edge 6, x of the i-th at 10 i.
std::string write_row(const TempFolder& folder, std::uint32_t count) {
  const std::vector<build::Position> corners{{0, 0, 0}, {6, 0, 0}, {0, 6, 0}, {0, 0, 6}};
  const std::vector<build::Triangle> triangles{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::vector<build::Position> all;
  std::vector<build::Triangle> faces;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const build::Position& p : corners) all.push_back({p[0] + 10.0f * static_cast<float>(i), p[1], p[2]});
    for (const build::Triangle& t : triangles) faces.push_back({t[0] + 4 * i, t[1] + 4 * i, t[2] + 4 * i});
  }
  const std::vector<build::TriangleMesh> meshes{{all, faces}};
  const auto bvh = build::build(meshes);
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / "row.bvh", bvh->buffer.bytes()).has_value());
  return folder / "row.bvh";
}

/// The box that the ray through the picture's middle meets first.
std::uint32_t middle(const ExrFile& file) { return file.uint_at("id.primitive", file.width / 2, file.height / 2); }

}  // namespace

TEST_CASE("bvhrender: level 0 is the scene's box, deeper levels have more and smaller ones") {
  const TempFolder folder;
  const std::string row = write_row(folder, 4);
  const auto draw = [&](const std::string& level) {
    // Along z, at the gap between the second and the third tetrahedron.
    render_well({row, "-o", folder / "b.exr", "--mode", "bvh", "--level", level, "--size", "65x65", "--spp", "1",
                 "--camera", "18,3,60/18,3,0/0,1,0/40"});
    return read_exr(folder / "b.exr");
  };
  const ExrFile whole = draw("0"), parts = draw("6");
  CHECK(middle(whole) == 0);
  CHECK(whole.at("Z", 32, 32) == 54.0f);
  CHECK(middle(parts) == 0xffffffffu);
  CHECK(whole.attributes.at("mode") == "bvh, level 0");
  std::size_t boxes = 0;
  for (const std::uint32_t box : parts.uints.at("id.primitive")) boxes += box != 0xffffffffu ? 1 : 0;
  CHECK(boxes > 0);
  // The edges are dark.
  float darkest = 1, brightest = 0;
  for (std::uint32_t x = 0; x < 65; ++x)
    if (whole.uint_at("id.primitive", x, 32) == 0) {
      darkest = std::min(darkest, whole.at("G", x, 32));
      brightest = std::max(brightest, whole.at("G", x, 32));
    }
  CHECK(darkest == 0.02f);
  CHECK(brightest > 0.1f);
}

TEST_CASE("bvhrender: the boxes of a tree need no tracer of its primitives") {
  const TempFolder folder;
  const std::vector<Box> boxes{{{0, 0, 0}, {1, 1, 1}}};
  const build::CustomGeometry customs[1] = {{.boxes = boxes}};
  const auto bvh = build::build(build::SceneInput{{}, customs});
  REQUIRE(bvh.has_value());
  REQUIRE(build::write_file(folder / "c.bvh", bvh->buffer.bytes()).has_value());
  render_well({folder / "c.bvh", "-o", folder / "c.exr", "--mode", "bvh", "--size", "9x9", "--spp", "1"});
  CHECK(middle(read_exr(folder / "c.exr")) == 0);
}

TEST_CASE("bvhrender: trees without boxes, and levels of other modes, are refused") {
  const TempFolder folder;
  const CommandResult nothing =
      render({write_nothing(folder), "-o", folder / "n.png", "--mode", "bvh", "--camera", kFront});
  CHECK(nothing.status == 1);
  CHECK_THAT(nothing.err, Contains("the tree is empty"));
  const CommandResult other = render({write_squares(folder), "-o", folder / "n.png", "--level", "2"});
  CHECK(other.status == 2);
  CHECK_THAT(other.err, Contains("--level is of --mode bvh"));
  CHECK(folder.names() == std::vector<std::string>{"empty.bvh", "s.bvh"});
}
