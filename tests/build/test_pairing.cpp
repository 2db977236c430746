// Pairs of triangles in a leaf: both belong to one mesh and share an edge, for any index buffer.

#include <hiprt_build/pair/pair.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <tests/catch.h>

#include <algorithm>

using namespace hiprt;
using namespace hiprt::oracle;

namespace {

/// Runs the pairing step alone.
struct Pairing {
  build::ProgressCallback no_progress;
  build::Monitor monitor{no_progress};
  build::MemoryLedger ledger;
  build::CpuEngine engine{monitor, ledger};
  build::PairedPrimitives paired;

  explicit Pairing(const build::BuildInput& input, bool pair = true)
      : paired(build::pair_primitives(engine, input, pair)) {}

  std::span<const build::LeafPrimitives> all() const { return paired.leaves.span().first(paired.count); }
};

build::BuildInput input_of(const std::vector<build::TriangleMesh>& meshes) {
  return build::BuildInput(build::SceneInput{meshes, {}});
}

/// Every triangle that is not dropped is in one leaf; pairs run through a common edge in opposite directions.
void check_leaves(const build::BuildInput& input, const Pairing& pairing) {
  std::vector<std::vector<unsigned>> seen;
  for (const build::TriangleMesh& mesh : input.meshes) seen.emplace_back(mesh.triangles.size(), 0u);
  std::uint64_t pairs = 0;
  for (const build::LeafPrimitives& leaf : pairing.all()) {
    const std::uint32_t geometry = input.table().find(leaf.primitive);
    const std::uint32_t first = leaf.primitive - input.geometries[geometry].first;
    const std::uint32_t triangles[2] = {first, first + leaf.contents.distance()};
    ++seen[geometry][triangles[0]];
    if (!leaf.contents.is_pair()) continue;
    ++pairs;
    ++seen[geometry][triangles[1]];
    const auto corner = [&](unsigned triangle, unsigned k) {
      const unsigned rotation = triangle == 0 ? leaf.contents.rotation0() : leaf.contents.rotation1();
      const build::TriangleMesh& mesh = input.meshes[geometry];
      return mesh.positions[mesh.triangles[triangles[triangle]][(k + rotation) % 3]];
    };
    // Triangle 0 is v0 v1 v2, triangle 1 is v1 v3 v2.
    REQUIRE(corner(0, 1) == corner(1, 0));
    REQUIRE(corner(0, 2) == corner(1, 2));
  }
  CHECK(pairs == pairing.paired.pairs);
  std::uint64_t dropped = 0;
  for (const auto& mesh : seen)
    for (const unsigned count : mesh) {
      REQUIRE(count <= 1);
      dropped += count == 0 ? 1 : 0;
    }
  CHECK(dropped == pairing.paired.dropped_not_finite + pairing.paired.dropped_degenerate);
}

double paired_share(const Mesh& mesh) {
  const std::vector meshes{mesh.view()};
  const build::BuildInput input = input_of(meshes);
  const Pairing pairing(input);
  check_leaves(input, pairing);
  return 2.0 * static_cast<double>(pairing.paired.pairs) / static_cast<double>(mesh.triangles.size());
}

}  // namespace

TEST_CASE("most triangles of a closed mesh find a partner, also without shared vertices and in random order") {
  for (const auto& [name, mesh] : {std::pair("icosphere", icosphere(5)), std::pair("torus", torus(80, 40, 0.4)),
                                   std::pair("box", subdivided_box(30, 1.2, 1)), std::pair("star", star(5, 2))}) {
    const double share = paired_share(mesh), shuffled = paired_share(scattered(mesh, 3));
    std::printf("%-10s paired %.3f, shuffled %.3f\n", name, share, shuffled);
    CHECK(share > 0.85);
    CHECK(shuffled > 0.85);
  }
}

TEST_CASE("a flat grid pairs into its quads") { CHECK(paired_share(grid_plane(64, 1, 0.0f)) > 0.95); }

TEST_CASE("where pairs save the same area the edge with the lowest number comes first") {
  // A strip of nine triangles. Edge 0 of each is shared with the next one.
  Mesh strip;
  for (std::uint32_t i = 0; i < 11; ++i)
    strip.positions.push_back({0.5f * static_cast<float>(i), static_cast<float>(i % 2), 0});
  for (std::uint32_t i = 0; i < 9; ++i)
    strip.triangles.push_back(i % 2 == 0 ? Triangle{i + 1, i + 2, i} : Triangle{i + 2, i + 1, i});
  const std::vector meshes{strip.view()};
  const build::BuildInput input = input_of(meshes);
  const Pairing pairing(input);
  check_leaves(input, pairing);
  REQUIRE(pairing.paired.pairs == 4);
  for (std::uint32_t i = 0; i < 5; ++i) {
    CHECK(pairing.all()[i].primitive == 2 * i);
    CHECK(pairing.all()[i].contents.is_pair() == (i < 4));
  }
}

TEST_CASE("triangles pair only within a mesh, never across non-manifold edges of equal direction") {
  const Mesh one = icosphere(2);
  Mesh other = one;
  for (Triangle& t : other.triangles) std::swap(t[0], t[1]);  // Inside out.
  Mesh fan;  // Seven triangles around one edge, all running through it in the same direction.
  fan.positions = {{0, 0, 0}, {0, 0, 1}};
  for (int i = 0; i < 7; ++i) {
    fan.positions.push_back({std::cos(0.8f * static_cast<float>(i)), std::sin(0.8f * static_cast<float>(i)), 0});
    fan.triangles.push_back({0, 1, static_cast<std::uint32_t>(2 + i)});
  }
  const std::vector meshes{one.view(), other.view(), fan.view(), Mesh{}.view()};
  const build::BuildInput input = input_of(meshes);
  const Pairing pairing(input);
  check_leaves(input, pairing);
  for (const build::LeafPrimitives& leaf : pairing.all())
    CHECK((input.table().find(leaf.primitive) != 2 || !leaf.contents.is_pair()));
}

TEST_CASE("odd meshes: every triangle is in one leaf or dropped and counted") {
  const Mesh a = torture(3000, 5), b = identical(500), c = needles(500, 1e6, 6);
  const std::vector meshes{a.view(), b.view(), c.view()};
  const build::BuildInput input = input_of(meshes);
  check_leaves(input, Pairing(input));
  const Pairing single(input, false);
  check_leaves(input, single);
  CHECK(single.paired.pairs == 0);
}
