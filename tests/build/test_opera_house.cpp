// Small triangles in a large hall: 30-bit Morton codes lose their order, 63-bit codes keep it.

#include <hiprt_build/format/view.h>
#include <tests/oracle/cost_within.h>
#include <tests/oracle/opera_house.h>

#include <tests/catch.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

/// The expected cost of a ray at the object.
double object_cost(const Mesh& mesh, build::Builder builder) {
  const auto bvh = build::build(std::vector{mesh.view()}, {.builder = builder});
  REQUIRE(bvh.has_value());
  return cost_within(*open_buffer(bvh->buffer.bytes()), opera_object_box());
}

}  // namespace

TEST_CASE("a small object in a large hall: 30-bit Morton codes ruin the object's tree, 63-bit codes do not") {
  constexpr unsigned kTriangles = 40000;
  std::printf("%10s %10s %10s %10s\n", "hall", "lbvh30", "lbvh", "hploc");
  double small_hall = 0;
  for (const double ratio : {8.0, 20000.0}) {
    CAPTURE(ratio);
    const Mesh mesh = opera_house(kTriangles, ratio);
    CHECK(mesh.triangles.size() > kTriangles / 10 * 8);
    CHECK(mesh.triangles.size() < kTriangles / 10 * 12);
    const double coarse = object_cost(mesh, build::Builder::kLbvh30), fine = object_cost(mesh, build::Builder::kLbvh),
                 joined = object_cost(mesh, build::Builder::kHploc);
    std::printf("%10.0f %10.2f %10.2f %10.2f\n", ratio, coarse, fine, joined);
    CHECK(joined < fine);
    if (ratio < 1000) {
      // The object has a good part of the grid's cells.
      CHECK(coarse < 1.3 * fine);
      small_hall = fine;
    } else {
      CHECK(coarse > 10 * fine);
      CHECK(fine < 1.3 * small_hall);
    }
  }
}
