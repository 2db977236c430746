// The builder hq beside others: pre-split references, and costs.

#include <hiprt_build/input/references.h>
#include <hiprt_build/pair/pair.h>
#include <hiprt_build/presplit/presplit.h>
#include <hiprt_build/statistics.h>
#include <tests/build/machine.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <map>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::build;

namespace {

double cost_of(const Mesh& mesh, const BuildOptions& options) {
  const auto bvh = build::build(std::vector{mesh.view()}, options);
  REQUIRE(bvh.has_value());
  return measure_tree(*open_buffer(bvh->buffer.bytes())).sah_cost;
}

/// The leaves of a mesh, and the references of its pre-split.
struct PreSplit {
  BuildInput input;
  PairedPrimitives paired;
  std::vector<Box> boxes;               ///< Of the leaves.
  std::vector<std::vector<Box>> parts;  ///< Of each leaf: its references' boxes.
  std::size_t references = 0;

  PreSplit(Machine& machine, const std::vector<TriangleMesh>& meshes, double budget)
      : input(SceneInput{meshes, {}}), paired(pair_primitives(machine.engine, input, true)), parts(paired.count) {
    auto whole = machine.engine.allocate<Reference>(paired.count);
    machine.engine.for_each(paired.count, MakeReferenceStep{input.table(), paired.leaves.span(), whole.span()});
    for (std::size_t i = 0; i < paired.count; ++i) boxes.push_back(whole[i].box);
    std::map<std::uint32_t, std::size_t> leaf_of;
    for (std::size_t i = 0; i < paired.count; ++i) leaf_of[paired.leaves[i].primitive] = i;
    const auto split = presplit(machine.engine, input.table(), std::move(whole), budget);
    references = split.size();
    for (const Reference& part : split.span()) parts[leaf_of.at(part.primitive)].push_back(part.box);
  }
};

/// Every part is a box within its leaf's box.
void check_parts_within(const PreSplit& split) {
  for (std::size_t leaf = 0; leaf < split.parts.size(); ++leaf)
    for (const Box& inner : split.parts[leaf]) {
      const Box& outer = split.boxes[leaf];
      for (int axis = 0; axis < 3; ++axis) {
        REQUIRE(outer.min[axis] <= inner.min[axis]);
        REQUIRE(inner.min[axis] <= inner.max[axis]);
        REQUIRE(inner.max[axis] <= outer.max[axis]);
      }
    }
}

/// Whether a box contains the point of the first triangle with these barycentric weights, up to rounding.
bool holds_point(const Box& box, const LeafCorners& corners, const double (&w)[3]) {
  const double sum = w[0] + w[1] + w[2];
  bool inside = true;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double x = (w[0] * double{corners.v[0].x[axis]} + w[1] * double{corners.v[1].x[axis]} +
                      w[2] * double{corners.v[2].x[axis]}) /
                     sum;
    const double slack = 1e-12 * std::abs(x);
    inside = inside && x >= double{box.min[axis]} - slack && x <= double{box.max[axis]} + slack;
  }
  return inside;
}

/// Points of every leaf's first triangle are in one of the leaf's parts.
void check_parts_cover(const PreSplit& split, Random& random) {
  for (std::size_t leaf = 0; leaf < split.parts.size(); ++leaf) {
    const LeafCorners corners = leaf_corners(split.input.table(), split.paired.leaves[leaf]);
    for (int i = 0; i < 20; ++i) {
      // A point of the triangle, or a corner.
      double w[3] = {random.unit(), random.unit(), random.unit()};
      if (i < 3) w[0] = i == 0, w[1] = i == 1, w[2] = i == 2;
      REQUIRE(std::any_of(split.parts[leaf].begin(), split.parts[leaf].end(),
                          [&](const Box& box) { return holds_point(box, corners, w); }));
    }
  }
}

}  // namespace

TEST_CASE("pre-splits stay in their triangles' boxes, cover the triangles and keep to the budget") {
  Machine machine;
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  INFO("seed " << kSeed);
  // In the last one boxes are a few floats wide: they cannot be split as often as is planned.
  for (const Mesh& mesh : {icosphere(3), soup(2000, 0.5, 1), needles(2000, 1e4, 2), torture(2000, 3), identical(100),
                           oracle::placed(soup(500, 0.5, 5), 1e30), oracle::placed(soup(500, 0.5, 6), 1e-30),
                           oracle::placed(soup(500, 0.5, 7), 0x1p-21, {1, 1, 1})})
    for (const double budget : {1.0, 1.01, 1.5, 8.0}) {
      const std::vector<TriangleMesh> meshes{mesh.view()};
      const PreSplit split(machine, meshes, budget);
      CAPTURE(mesh.triangles.size(), budget, split.paired.count, split.references);
      REQUIRE(split.references >= split.paired.count);
      REQUIRE(static_cast<double>(split.references) <= budget * static_cast<double>(split.paired.count));
      check_parts_within(split);
      check_parts_cover(split, random);
    }
}

TEST_CASE("pre-splits lower the cost of trees over long triangles, and a larger budget lowers it further") {
  const Mesh mesh = needles(20000, 1e3, 6);
  double cost[3];
  int i = 0;
  for (const double budget : {1.0, 1.5, 4.0})
    cost[i++] = cost_of(mesh, {.builder = Builder::kHploc, .presplit_budget = budget, .reinsertion_rounds = 32});
  CHECK(cost[1] < 0.95 * cost[0]);
  CHECK(cost[2] < 0.95 * cost[1]);
}

TEST_CASE("costs compared with Embree's high quality: sbvh with reinsertion, hq, and pre-split hploc") {
  std::printf("%-12s %8s %8s %8s %8s %8s\n", "mesh", "sbvh", "sbvh+8", "hq", "cheaper", "high");
  for (const auto& [name, mesh] :
       {std::pair("icosphere", icosphere(6)), std::pair("star", star(6, 2)), std::pair("soup", soup(50000, 0.05, 4)),
        std::pair("large soup", soup(20000, 0.5, 5)), std::pair("needles", needles(20000, 1e3, 6))}) {
    const double sbvh = cost_of(mesh, {.builder = Builder::kSbvh});
    const double moved = cost_of(mesh, {.builder = Builder::kSbvh, .reinsertion_rounds = 8});
    const double hq = cost_of(mesh, {.builder = Builder::kHq}), high = cost_of(mesh, {.builder = oracle::kEmbreeHigh});
    const double cheaper =
        cost_of(mesh, {.builder = Builder::kHploc, .presplit_budget = 1.5, .reinsertion_rounds = 32});
    std::printf("%-12s %8.2f %8.2f %8.2f %8.2f %8.2f\n", name, sbvh, moved, hq, cheaper, high);
    CHECK(moved <= 1.001 * sbvh);
    CHECK(moved <= 1.05 * high);
    CHECK(hq <= 1.001 * moved);
    CHECK(cheaper <= 1.05 * high);
  }
}
