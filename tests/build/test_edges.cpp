// Partners of edges that many triangles share. The list of a vertex's edges is written by many threads in any order;
// the partners must not depend on it.

#include <hiprt_build/pair/edges.h>
#include <tests/build/machine.h>

#include <tests/catch.h>

#include <map>

using namespace hiprt;
using namespace hiprt::build;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261127;

struct Fans {
  std::vector<Position> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Triangles around @p edges edges, in random order; each edge has @p size of them, two fifths in
/// one direction.
Fans fans(std::uint32_t edges, std::uint32_t size) {
  Random random(kSeed);
  Fans made;
  for (std::uint32_t i = 0; i < 2 * edges; ++i) made.positions.push_back(random.in_cube(1));
  for (std::uint32_t i = 0; i < edges * size; ++i) {
    const std::uint32_t from = 2 * (i % edges), tip = static_cast<std::uint32_t>(made.positions.size());
    made.positions.push_back(random.in_cube(1));
    // More in one direction than in the other: then the first ones have partners.
    const bool forward = i / edges % 5 < 2;
    made.triangles.push_back({forward ? from : from + 1, forward ? from + 1 : from, tip});
  }
  for (std::size_t i = made.triangles.size(); i-- > 1;)
    std::swap(made.triangles[i], made.triangles[random.below(static_cast<std::uint32_t>(i + 1))]);
  return made;
}

/// Edge 0 of each triangle: the i-th in one direction and the i-th in the other, in the order of triangles.
std::vector<HalfEdge> expected_partners(const Fans& of) {
  std::map<std::uint32_t, std::vector<HalfEdge>> forward, backward;
  for (std::uint32_t i = 0; i < of.triangles.size(); ++i) {
    const auto [from, to, tip] = of.triangles[i];
    (from < to ? forward : backward)[std::min(from, to)].push_back(4 * i);
  }
  std::vector<HalfEdge> partner(of.triangles.size(), kInvalidId);
  for (const auto& [edge, ahead] : forward)
    for (std::size_t i = 0; i < std::min(ahead.size(), backward.at(edge).size()); ++i) {
      const HalfEdge a = ahead[i], b = backward.at(edge)[i];
      if (!MatchEdgesStep::may_pair(a, b)) continue;
      partner[a >> 2] = b;
      partner[b >> 2] = a;
    }
  return partner;
}

void check_fans(std::uint32_t edges, std::uint32_t size) {
  const Fans made = fans(edges, size);
  const std::vector<HalfEdge> expected = expected_partners(made);
  CHECK(std::count_if(expected.begin(), expected.end(), [](HalfEdge e) { return e != kInvalidId; }) > 100);
  const TriangleMesh mesh{.positions = made.positions, .triangles = made.triangles};
  const std::vector<std::uint8_t> dropped(made.triangles.size());
  for (unsigned run = 0; run < 4; ++run) {
    Machine machine;
    const auto partner = find_partners(machine.engine, mesh, dropped);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      INFO("seed " << kSeed << ", run " << run << ", triangle " << i);
      REQUIRE(partner[3 * i] == expected[i]);
    }
  }
}

}  // namespace

TEST_CASE("edges of more than four triangles are matched in the order of triangles", "[edges]") {
  check_fans(1, 10000);
  check_fans(1000, 9);
  check_fans(300, 80);
}
