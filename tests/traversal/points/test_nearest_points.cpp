// The k nearest triangles, and all within a distance, against every triangle tried.

#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/points/point_queries.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261130;

std::vector<Mesh> meshes() {
  Mesh twice = icosphere(2);
  append(twice, icosphere(2));  // Every distance twice.
  return {star(3, 7), oracle::soup(200, 0.3, 2), twice, oracle::needles(100, 1e5, 9)};
}

/// With and without split triangles.
std::array<Scene, 3> scenes(const std::vector<Mesh>& of) {
  return {make_scene(of), make_scene(of, {.builder = kEmbreeHigh}),
          make_scene(of, {.builder = build::Builder::kHploc, .max_leaf_triangles = 8})};
}

PointQuery any_query(const std::vector<Mesh>& of, Random& random) {
  PointQuery query{point_near(of[random.below(4)], random, 1.0, {})};
  if (random.coin()) query.max_distance = static_cast<float>(random.log_uniform(0.01, 10));
  return query;
}

template <class P = Policies>
FoundCount ask(const Scene& scene, const PointQuery& query, std::vector<ClosestPoint>& results) {
  typename P::Stack::Memory memory;
  return nearest_points<P>(scene.traced, query, results.data(), static_cast<std::uint32_t>(results.size()), memory);
}

struct SmallStack : Policies {
  using Stack = PrivateStack<4>;
};

}  // namespace

TEST_CASE("the nearest points come in order, each once, whatever the tree") {
  const std::vector<Mesh> of = meshes();
  for (const Scene& scene : scenes(of)) {
    Random random(kSeed);
    for (unsigned i = 0; i < trials(300); ++i) {
      const PointQuery query = any_query(of, random);
      const auto expected = try_all(of, query);
      const std::uint32_t most = i % 4 == 0 ? 1 : 1 + random.below(40);
      std::vector<ClosestPoint> found(most);
      const FoundCount count = ask(scene, query, found);
      INFO(scene.name << ", seed " << kSeed << ", point " << i);
      REQUIRE(!count.failed());
      REQUIRE(count.count == std::min<std::size_t>(most, expected.size()));
      REQUIRE(count.state == (expected.size() >= most ? TraversalState::kHit : TraversalState::kFinished));
      for (std::uint32_t k = 0; k < count.count; ++k) REQUIRE(same_point(found[k], expected[k]));
    }
  }
}

TEST_CASE("all triangles within a distance, each once") {
  const std::vector<Mesh> of = meshes();
  for (const Scene& scene : scenes(of)) {
    Random random(kSeed + 1);
    for (unsigned i = 0; i < trials(200); ++i) {
      PointQuery query = any_query(of, random);
      query.max_distance = static_cast<float>(random.log_uniform(0.01, 0.5));
      const auto expected = try_all(of, query);
      std::vector<ClosestPoint> found;
      PrivateStack<>::Memory memory;
      const auto take = [&](const ClosestPoint& point) {
        found.push_back(point);
        return true;
      };
      INFO(scene.name << ", seed " << kSeed + 1 << ", point " << i);
      const FoundCount count = points_within<Policies>(scene.traced, query, memory, take);
      REQUIRE((count.state == TraversalState::kFinished && count.count == found.size()));
      std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return precedes(a, b); });
      REQUIRE(found.size() == expected.size());
      for (std::size_t k = 0; k < found.size(); ++k) REQUIRE(same_point(found[k], expected[k]));

      // With repetitions: the same set.
      found.clear();
      points_within<Policies, SplitPrimitives::kRepeat>(scene.traced, query, memory, take);
      std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return precedes(a, b); });
      found.erase(std::unique(found.begin(), found.end(), same_point<float>), found.end());
      REQUIRE(found.size() == expected.size());
    }
  }
}

TEST_CASE("a callback stops the search, and no room is no result") {
  const std::vector<Mesh> of{icosphere(2)};
  for (const Scene& scene : scenes(of)) {
    unsigned calls = 0;
    PrivateStack<>::Memory memory;
    const FoundCount count = points_within<Policies>(scene.traced, {Vec3(0), 2.0f}, memory,
                                                     [&](const ClosestPoint&) { return ++calls < 3; });
    REQUIRE((count.state == TraversalState::kHit && count.count == 3 && calls == 3));
    std::vector<ClosestPoint> none;
    REQUIRE((ask(scene, {Vec3(0)}, none).count == 0 && !ask(scene, {Vec3(0)}, none).failed()));
  }
}

TEST_CASE("a filter leaves triangles out, and may end the search") {
  const std::vector<Mesh> of{icosphere(2)};
  const Scene scene = make_scene(of);
  const PointQuery query{{0.2f, 0.1f, 1.2f}};
  const auto expected = try_all(of, query);
  struct NotFirst {
    std::uint32_t primitive;
    FilterResult operator()(const PointQuery&, const ClosestPoint& point) const {
      return point.primitive == primitive ? FilterResult::kReject : FilterResult::kAccept;
    }
  };
  PrivateStack<>::Memory memory;
  std::vector<ClosestPoint> found(5);
  const FoundCount count =
      nearest_points<Policies, NotFirst>(scene.traced, query, found.data(), 5, memory, NotFirst{expected[0].primitive});
  REQUIRE(count.count == 5);
  for (std::size_t k = 0; k < 5; ++k) REQUIRE(same_point(found[k], expected[k + 1]));
  const auto stop = [](const PointQuery&, const ClosestPoint&) { return FilterResult::kAcceptAndStop; };
  REQUIRE(nearest_points<Policies, decltype(stop)>(scene.traced, query, found.data(), 5, memory, stop).count == 1);
}

TEST_CASE("queries for several points fail clearly") {
  const Scene half = make_scene({icosphere(1)}, {.nodes = NodeLayout::kHalf}), scene = make_scene({star(4, 5)});
  std::vector<ClosestPoint> found(3);
  REQUIRE(ask(half, {}, found).state == TraversalState::kRefused);
  PrivateStack<>::Memory memory;
  const auto take = [](const ClosestPoint&) { return true; };
  REQUIRE(points_within<Policies>(half.traced, {}, memory, take).failed());
  REQUIRE(ask<SmallStack>(scene, {Vec3(0)}, found).state == TraversalState::kStackOverflow);
}
