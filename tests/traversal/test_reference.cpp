// The Reference triangle test against exact arithmetic: which triangles of a leaf a ray hits, and where. A line crosses
// a closed surface an even number of times.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/brute_force.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/oracle/ray_beside.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/triangle_cases.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

#include <optional>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 61;

using Met = std::array<std::optional<Candidate>, 2>;

template <class Lanes> Met meet(const Pair& pair, const Ray& ray) {
  const PlanesLeaf leaf = pair.leaf();
  Met met;
  Reference::intersect<Lanes>(leaf, leaf.info, Reference::PreparedRay<Lanes>(ray),
                              [&](const Candidate& at, unsigned triangle) {
                                CHECK(!met[triangle]);
                                met[triangle] = at;
                                return true;
                              });
  return met;
}

/// Of what many cases have shown.
struct Tally {
  std::uint64_t met = 0, ties = 0;
  double most_ulps = 0.0, most_weight = 0.0;

  template <class Lanes> void check(const Case& it) {
    const Met met_here = meet<Lanes>(it.pair, it.ray);
    for (unsigned i = 0; i < 2; ++i) {
      const Corners corners = it.pair.triangle(i);
      INFO("triangle " << i);
      const bool passes = passes_beside(it.ray, corners) && plane_sign(it.ray, corners) != 0;
      REQUIRE(met_here[i].has_value() == passes);
      if (!passes) continue;
      ++met;
      const ExactPoint exact = exact_point(it.ray, corners);
      if (sgn(exact.u) == 0 || sgn(exact.v) == 0 || exact.u + exact.v == 1) ++ties;
      const Candidate at = *met_here[i];
      if (nearest_float(exact.t) == std::numeric_limits<float>::infinity() ||
          nearest_float(exact.t) == -std::numeric_limits<float>::infinity()) {
        CHECK(at.t == nearest_float(exact.t));
        continue;
      }
      if (sgn(exact.t) < 0) {  // Never reported.
        CHECK(at.t <= 0.0f);
        continue;
      }
      const double ulps = error_in_ulps(at.t, exact.t);
      CHECK(ulps < 1.0);
      most_ulps = std::max(most_ulps, ulps);
      most_weight = std::max({most_weight, absolute_error(at.u, exact.u), absolute_error(at.v, exact.v)});
    }
  }
};

}  // namespace

TEST_CASE("exact sums have the sign and the value of the sum", "[reference]") {
  Random random(kSeed);
  INFO("seed " << kSeed);
  for (int i = 0; i < 20000; ++i) {
    float v[3][3];
    const bool lattice = random.coin();
    for (auto& row : v)
      for (float& x : row) {
        do x = lattice ? static_cast<float>(random.below(5)) - 2.0f : random.any_float();
        while (!std::isfinite(x));
      }
    ExactSum<36> sum;
    const unsigned times = 1 + random.below(3);
    for (unsigned k = 0; k < times; ++k) sum.add_determinant(v[0], v[1], v[2]);
    const auto integers = [&](int row) { return Integer3{scaled(v[row][0]), scaled(v[row][1]), scaled(v[row][2])}; };
    const Integer truth = times * dot(integers(0), cross(integers(1), integers(2)));
    REQUIRE(sum.sign() == sgn(truth));
    const Rational exact = quotient(truth, Integer(1) << (3 * kFloatScale));
    REQUIRE(abs(Rational(sum.value()) - exact) <= abs(exact) / (Integer(1) << 51));
  }
}

TEST_CASE("a leaf's triangles are hit as exact arithmetic says", "[reference]") {
  for (int kind = 0; kind < static_cast<int>(Kind::kCount); ++kind) {
    Tally tally;
    const unsigned cases = trials(40000);
    check_cases(kind, kSeed, cases, [&](const Case& it) {
      tally.check<DefaultLanes>(it);
      tally.check<ArrayLanes>(it);
    });
    std::printf("reference, kind %d: %lu met, %lu on an edge, t within %.3f ulp, u and v within %.3g\n", kind,
                tally.met, tally.ties, tally.most_ulps, tally.most_weight);
    CHECK(tally.met > cases / 100);
    CHECK(tally.most_weight < 0x1p-21);
  }
}

TEST_CASE("a triangle's hit does not depend on the other one of its leaf", "[reference]") {
  for (int kind = 0; kind < static_cast<int>(Kind::kCount); ++kind) {
    Random random(kSeed);
    unsigned met = 0;
    const unsigned cases = trials(40000);
    check_cases(kind, kSeed, cases, [&](const Case& it) {
      const Met together = meet<DefaultLanes>(it.pair, it.ray);
      for (unsigned k = 0; k < 2; ++k) {
        const std::array<unsigned, 3> corner = k == 0 ? std::array{0u, 1u, 2u} : std::array{1u, 3u, 2u};
        Pair single;
        for (unsigned n = 0; n < 4; ++n) single.vertex[n] = it.pair.vertex[corner[n < 3 ? n : random.below(3)]];
        const Met alone = meet<DefaultLanes>(single, it.ray);
        REQUIRE(alone[0].has_value() == together[k].has_value());
        if (!alone[0]) continue;
        ++met;
        REQUIRE((same_bits(alone[0]->t, together[k]->t) && same_bits(alone[0]->u, together[k]->u) &&
                 same_bits(alone[0]->v, together[k]->v)));
      }
    });
    CHECK(met > cases / 100);
  }
}

TEST_CASE("a ray from outside crosses a closed surface an even number of times", "[reference]") {
  struct Tracer : Policies {
    using Triangle = Reference;
  };
  for (const Closed& closed : closed_meshes()) {
    const Scene scene = make_scene({closed.mesh}, {.nodes = NodeLayout::kPlanes});
    std::uint64_t rays = 0, crossings = 0;
    Random random(kSeed);
    INFO(closed.name << ", seed " << kSeed);
    for (unsigned i = 0; i < trials(20000); ++i) {
      // Its line, from outside.
      Ray ray = aimed_ray(closed, random, 1.0);
      const Double3 away = random.on_sphere();
      const Double3 to = target_point(closed.mesh, random);
      for (int k = 0; k < 3; ++k) {
        const auto axis = static_cast<std::size_t>(k);
        ray.origin[k] = static_cast<float>(8 * away[axis]);
        ray.direction[k] = static_cast<float>(to[axis] - double{ray.origin[k]});
      }
      if (i % 4 == 0) {  // In face planes and along edges of the box, and through vertices of the round meshes.
        const int k = static_cast<int>(random.below(3)), other = (k + 1) % 3;
        ray.origin[other] = random.coin() ? 8.0f : -8.0f;
        ray.direction[other] = -ray.origin[other];
        ray.direction[k] = 0.0f;
        ray.origin[k] = static_cast<float>(to[static_cast<std::size_t>(k)]);
      }
      Tracer::Stack::Memory stack;
      AllHits<Tracer> hits(scene.traced, ray, stack);
      unsigned count = 0;
      while (hits.next_hit().found()) ++count;
      ++rays;
      crossings += count;
      INFO(describe(ray));
      REQUIRE(count % 2 == 0);
    }
    CHECK(crossings > rays);
  }
}

namespace {

template <class LayoutType> struct Exact : WithLayout<LayoutType> { using Triangle = hiprt::Reference; };

template <class Layout> Hit closest_in(const Scene& scene, const Ray& ray) {
  return closest_hit<Exact<Layout>>(scene.traced, ray);
}

Hit closest_in(const Scene& scene, const Ray& ray) {
  return dispatch_layout(scene.traced.layout, [&](auto layout) { return closest_in<decltype(layout)>(scene, ray); });
}

}  // namespace

TEST_CASE("from inside a closed mesh every ray has one nearest hit, at scales from 1e-30 to 1e30", "[reference]") {
  struct Location {
    double scale;
    Double3 offset;
  };
  const Location locations[] = {{1e-30, {0, 0, 0}},      {1e-15, {0, 0, 0}}, {1, {0, 0, 0}},   {1, {1e3, 0, -1e3}},
                                {1e3, {1e7, -1e7, 1e7}}, {1e15, {0, 0, 0}},  {1e30, {0, 0, 0}}};
  double most_ulps = 0.0;
  std::uint64_t rays = 0;
  for (const Closed& unit : closed_meshes())
    for (const Location& at : locations) {
      const Closed closed = checks::placed(unit, at.scale, at.offset);
      INFO(closed.name << " at scale " << at.scale << ", offset " << at.offset[0] << ", seed " << kSeed);
      std::vector<Scene> scenes;
      for (const NodeLayout layout : {NodeLayout::kPlanes, NodeLayout::kFloat, NodeLayout::kQuantized}) {
        if (layout == NodeLayout::kQuantized && !fits_quantized({closed.mesh})) continue;
        scenes.push_back(
            make_scene({closed.mesh}, {.builder = scenes.empty() ? build::Builder::kSah : build::Builder::kLbvh,
                                       .nodes = layout,
                                       .pair_triangles = !scenes.empty()}));
      }
      Random random(kSeed);
      for (unsigned i = 0; i < trials(1000); ++i) {
        const Ray ray = aimed_ray(closed, random, 1.0);
        INFO(describe(ray));
        const Hit hit = closest_in(scenes[0], ray);
        REQUIRE(hit.found());
        const ExactPoint exact = exact_point(ray, corners(closed.mesh, hit.primitive));
        REQUIRE(passes_beside(ray, corners(closed.mesh, hit.primitive)));
        most_ulps = std::max(most_ulps, error_in_ulps(hit.t, exact.t));
        for (std::size_t k = 1; k < scenes.size(); ++k) {
          INFO(scenes[k].name);
          REQUIRE(same_hit(closest_in(scenes[k], ray), hit));
        }
        ++rays;
      }
    }
  std::printf("reference: %lu rays from inside, t within %.3f ulp\n", rays, most_ulps);
  CHECK(most_ulps < 1.0);
}
