/// Deferred decisions of the Reference test: during the search the known candidates are right, and the hits equal those
/// of immediate decisions, bit for bit.

#include <hiprt_device/hiprt_device.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/triangle_cases.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

#include <optional>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 67;

using Met = std::array<std::optional<Candidate>, 2>;

template <class Test, class Lanes> Met meet(const PlanesLeaf& leaf, const Reference::PreparedRay<Lanes>& ray) {
  Met met;
  Test::template intersect<Lanes>(leaf, leaf.info, ray, [&](const Candidate& at, unsigned triangle) {
    met[triangle] = at;
    return true;
  });
  return met;
}

struct BoundsSeen {
  unsigned bounded = 0, open = 0;
  double most = 0.0;  ///< Of a bound's distance from the middle, where t is.
};

template <class Lanes> void check_bounds(const Case& it, BoundsSeen& seen) {
  const PlanesLeaf leaf = it.pair.leaf();
  const Reference::PreparedRay<Lanes> ray(it.ray);
  const Met exact = meet<Reference, Lanes>(leaf, ray), bounds = meet<Reference::Bounds, Lanes>(leaf, ray);
  for (unsigned i = 0; i < 2; ++i) {
    INFO("triangle " << i);
    Candidate at{};
    REQUIRE(Reference::decide<Lanes>(leaf, ray, i != 0, leaf.info.triangle_ids >> (8 * i), at) == exact[i].has_value());
    if (exact[i]) {
      REQUIRE(bounds[i]);
      REQUIRE((same_bits(at.t, exact[i]->t) && same_bits(at.u, exact[i]->u) && same_bits(at.v, exact[i]->v)));
    }
    if (!bounds[i]) continue;
    const float low = bounds[i]->u, high = bounds[i]->t;
    if (!(std::isfinite(low) && std::isfinite(high))) {
      ++seen.open;
      continue;
    }
    ++seen.bounded;
    REQUIRE(exact[i]);
    // A t that is certainly negative is nobody's.
    if (high < 0.0f && at.t <= 0.0f) continue;
    REQUIRE(low < at.t);
    REQUIRE(at.t < high);
    const double half = 0.5 * (double{high} - double{low}), middle = 0.5 * (double{high} + double{low});
    seen.most = std::max(seen.most, std::abs(double{at.t} - middle) / half);
  }
}

/// Asks for everything, so that every decision is made at once.
struct Everything {
  template <class AnyHit> HIPRT_HD FilterResult operator()(const Ray&, const AnyHit&) const {
    return FilterResult::kAccept;
  }
};

struct P : Policies {
  using Triangle = Reference;
};

template <class Query> std::vector<Hit> hits_of(const Scene& scene, const Ray& ray) {
  typename P::Stack::Memory stack;
  Query query(scene.traced, ray, stack);
  std::vector<Hit> hits;
  for (Hit hit = query.next_hit(); hit.found(); hit = query.next_hit()) hits.push_back(hit);
  return hits;
}

template <template <class, class> class Query> void check_same(const Scene& scene, const Ray& ray) {
  const std::vector<Hit> later = hits_of<Query<P, NoFilter>>(scene, ray),
                         at_once = hits_of<Query<P, Everything>>(scene, ray);
  REQUIRE(later.size() == at_once.size());
  for (std::size_t i = 0; i < later.size(); ++i) {
    INFO("hit " << i << ": t " << later[i].t << " and " << at_once[i].t << ", primitives " << later[i].primitive
                << " and " << at_once[i].primitive);
    REQUIRE(same_hit(later[i], at_once[i]));
  }
}

template <class Policies, class Filter> using Closest = ClosestHit<Policies, Filter>;
template <class Policies, class Filter> using Any = AnyHit<Policies, Filter>;
template <class Policies, class Filter> using All = AllHits<Policies, Filter>;

/// Copies of a mesh, moved by at most two floats, some not at all.
std::vector<Mesh> layers(const Mesh& mesh, unsigned count, Random& random) {
  std::vector<Mesh> result;
  for (unsigned i = 0; i < count; ++i) {
    result.push_back(mesh);
    if (i % 3 == 0) continue;
    for (Position& p : result.back().positions)
      for (float& x : p)
        for (unsigned steps = random.below(3); steps-- > 0;) x = std::nextafter(x, random.coin() ? 2.0f : -2.0f);
  }
  return result;
}

}  // namespace

TEST_CASE("bounds contain the t of deferred decisions, and reject no line that passes through", "[deferred]") {
  for (int kind = 0; kind < static_cast<int>(Kind::kCount); ++kind) {
    BoundsSeen seen;
    const unsigned cases = trials(200000);
    check_cases(kind, kSeed, cases, [&](const Case& it) {
      check_bounds<DefaultLanes>(it, seen);
      check_bounds<ArrayLanes>(it, seen);
    });
    std::printf("deferred, kind %d: %u bounded, %u open, t at most at %.3f of the bounds\n", kind, seen.bounded,
                seen.open, seen.most);
    CHECK(seen.bounded + seen.open > cases / 100);
    CHECK(seen.most < 0.9);
  }
}

TEST_CASE("deferred decisions have the bits of immediate decisions", "[deferred]") {
  Random random(kSeed);
  INFO("seed " << kSeed);
  const Mesh star = oracle::star(2, kSeed);
  std::vector<std::vector<Mesh>> scenes{layers(star, 6, random),
                                        {identical(5)},
                                        {torture(300, kSeed)},
                                        {needles(300, 1e6, kSeed)},
                                        layers(soup(40, 0.5, kSeed), 4, random)};
  for (const Closed& closed : closed_meshes()) scenes.push_back({closed.mesh});
  for (std::size_t number = 0; number < scenes.size(); ++number) {
    CAPTURE(number);
    for (const auto builder : {build::Builder::kSah, oracle::kEmbreeHigh}) {
      const Scene scene = make_scene(scenes[number], {.builder = builder, .nodes = NodeLayout::kPlanes});
      std::size_t met = 0;
      for (unsigned i = 0; i < trials(3000); ++i) {
        const Mesh& mesh = scenes[number][random.below(static_cast<std::uint32_t>(scenes[number].size()))];
        const Double3 to = target_point(mesh, random);
        const Position from = random.in_cube(2);
        Ray ray;
        for (std::size_t k = 0; k < 3; ++k) {
          const int axis = static_cast<int>(k);
          ray.origin[axis] = from[k];
          ray.direction[axis] = static_cast<float>(to[k] - double{ray.origin[axis]});
        }
        if (!is_traceable(ray)) continue;
        const std::vector<Hit> hits = hits_of<AllHits<P>>(scene, ray);
        met += hits.size();
        // The range may end exactly at a hit, or a float beside it.
        const auto some_end = [&](float otherwise) {
          if (hits.empty() || random.below(3) == 0) return otherwise;
          const float t = hits[random.below(static_cast<std::uint32_t>(hits.size()))].t;
          const std::uint32_t beside = random.below(3);
          return beside == 0 ? t : std::nextafter(t, beside == 1 ? 0.0f : 1e30f);
        };
        ray.tmin = some_end(0.0f);
        ray.tmax = some_end(ray.tmax);
        INFO(scene.name << ", ray " << i << ": " << describe(ray));
        check_same<Closest>(scene, ray);
        check_same<Any>(scene, ray);
        check_same<All>(scene, ray);
      }
      CHECK(met > trials(3000) / 10);
    }
  }
}
