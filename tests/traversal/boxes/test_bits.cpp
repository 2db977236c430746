// Boxes whose distances are compared by their bits: BitLanes.

#include <hiprt_device/hiprt_device.h>

#include <tests/catch.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

using namespace hiprt;

namespace {

NodeRef child_ref(unsigned i) { return make_ref(256 * (i + 1), NodeType::kBox32); }

/// The children of a node at @p limit or before, in the order in which they are visited.
/// @param rank of their distances, which begin at -1: inside of a box. @param met bit per child: it is met.
std::vector<NodeRef> visited_within(const unsigned (&rank)[kBranching], std::uint32_t met, float limit) {
  PlanesBoxNode node{};
  for (unsigned i = 0; i < kBranching; ++i) node.child[i] = child_ref(i);
  const auto at = [&](unsigned i) { return static_cast<float>(rank[i]) - 1.0f; };
  const auto first = BitLanes::set(at(0), at(1), at(2), at(3));
  const auto hits = BoxHits<BitLanes>::by_bits(first, BitLanes::all(8.0f), met);
  PrivateStack<kBranching>::Memory memory;
  BacktrackOf<PrivateStack<kBranching>, StackEntry> backtrack(PrivateStack<kBranching>::Storage(memory), kInvalidRef);
  std::vector<NodeRef> result;
  for (NodeRef next = NearFirst::next_within(node, hits, limit, backtrack); next != kInvalidRef;
       next = backtrack.pop(8.0f))
    result.push_back(next);
  return result;
}

}  // namespace

TEST_CASE("by bits NearFirst visits the children up to the limit by their distance") {
  unsigned rank[kBranching] = {0, 1, 2, 3};
  do
    for (unsigned met = 0; met < 1u << kBranching; ++met)
      for (const float limit : {-0.0f, 0.0f, 0.5f, 1.0f, 8.0f, std::numeric_limits<float>::infinity()}) {
        CAPTURE(rank[0], rank[1], rank[2], rank[3], met, limit);
        std::vector<std::pair<unsigned, NodeRef>> nearest;
        for (unsigned i = 0; i < kBranching; ++i)
          if ((met >> i & 1u) != 0 && static_cast<float>(rank[i]) - 1.0f <= limit)
            nearest.push_back({rank[i], child_ref(i)});
        std::sort(nearest.begin(), nearest.end());
        std::vector<NodeRef> expected;
        for (const auto& [distance, ref] : nearest) expected.push_back(ref);
        REQUIRE(visited_within(rank, met, limit) == expected);
      }
  while (std::next_permutation(std::begin(rank), std::end(rank)));
}

TEST_CASE("by bits the ray meets boxes from where it begins on", "[boxes]") {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr Box kNone{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  // Behind the origin, around it, ahead, and none.
  PlanesBoxNode node{};
  PlanesLayout::set_box(node, 0, {{-1, -1, -3}, {1, 1, -2}});
  PlanesLayout::set_box(node, 1, {{-1, -1, -1}, {1, 1, 1}});
  PlanesLayout::set_box(node, 2, {{-1, -1, 2}, {1, 1, 3}});
  PlanesLayout::set_box(node, 3, kNone);
  const auto met = [&](const Ray& ray) {
    const RaySlabs<BitLanes> slabs(ray, 0x1p-20f, ray.tmin);
    const auto hits = intersect_boxes<BitLanes>(node, slabs, 0.0f, ray.tmax - ray.tmin);
    return (hits.hit(0) ? 1u : 0u) | (hits.hit(1) ? 2u : 0u) | (hits.hit(2) ? 4u : 0u) | (hits.hit(3) ? 8u : 0u);
  };
  const Vec3 origin(0, 0, 0), up(0.25f, 0.25f, 1), down(0.25f, 0.25f, -1);
  CHECK(met(Ray{.origin = origin, .direction = up}) == 6);
  CHECK(met(Ray{.origin = origin, .direction = down}) == 3);
  CHECK(met(Ray{.origin = origin, .tmin = 1.5f, .direction = up}) == 4);
  CHECK(met(Ray{.origin = origin, .tmin = 1.5f, .direction = up, .tmax = 1.75f}) == 0);
  CHECK(met(Ray{.origin = origin, .tmin = 3, .direction = up}) == 4);
  CHECK(met(Ray{.origin = origin, .tmin = 3.5f, .direction = up}) == 0);
  CHECK(met(Ray{.origin = origin, .direction = up, .tmax = 2}) == 6);
  CHECK(met(Ray{.origin = {0, 0, 2}, .tmin = 1, .direction = down, .tmax = 3}) == 2);
}
