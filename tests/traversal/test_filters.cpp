// Filters: cut-outs, self-intersection by id, early stop, and which candidates a filter sees.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/traverse/stacks/restart.h>
#include <tests/oracle/builders.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/every_hit.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 5207;
constexpr NodeLayout kLayouts[] = {NodeLayout::kFloat, NodeLayout::kPlanes, NodeLayout::kHalf, NodeLayout::kQuantized};

using Uv = std::array<float, 2>;

/// Texture coordinates per vertex of each geometry, and a texture with ring-shaped cut-outs.
struct Textured {
  std::vector<Mesh> meshes;
  std::vector<std::vector<Uv>> uvs;

  Uv at(const Hit& hit) const {
    const Triangle& t = meshes[hit.geometry].triangles[hit.primitive];
    const std::vector<Uv>& uv = uvs[hit.geometry];
    Uv result{};
    for (std::size_t k = 0; k < 2; ++k)
      result[k] = (1 - hit.u - hit.v) * uv[t[0]][k] + hit.u * uv[t[1]][k] + hit.v * uv[t[2]][k];
    return result;
  }
  /// Changes sign where the texture does.
  static double alpha(double u, double v) { return std::sin(40 * std::hypot(u - 0.5, v - 0.5)); }
};

Textured textured_soup() {
  Textured result{{soup(300, 0.8, kSeed), star(2, kSeed), soup(200, 0.8, kSeed + 1)}, {}};
  result.meshes[1].mask = 2;
  Random random(kSeed + 2);
  for (const Mesh& mesh : result.meshes) {
    result.uvs.emplace_back(mesh.positions.size());
    for (Uv& uv : result.uvs.back()) uv = {random.uniform_float(0, 1), random.uniform_float(0, 1)};
  }
  return result;
}

struct CutOut {
  const Textured* texture;
  FilterResult operator()(const Ray&, const Hit& hit) const {
    const Uv uv = texture->at(hit);
    return Textured::alpha(uv[0], uv[1]) < 0 ? FilterResult::kReject : FilterResult::kAccept;
  }
};

/// Records the candidates that it is called with, and returns the given value.
struct Witness {
  std::vector<Hit>* seen;
  FilterResult result = FilterResult::kAccept;
  std::uint32_t stop_at = kInvalidId;  ///< Hits of this geometry are the last.
  FilterResult operator()(const Ray&, const Hit& hit) const {
    seen->push_back(hit);
    return hit.geometry == stop_at ? FilterResult::kAcceptAndStop : result;
  }
};

Ray random_ray(Random& random) {
  Ray ray{vec3(random.in_cube(1.2)), 0.0f, vec3(random.in_cube(1))};
  if (random.below(4) == 0) ray.tmin = random.uniform_float(0, 0.6);
  if (random.below(4) == 0) ray.tmax = random.uniform_float(0.3, 1.5);
  if (random.below(4) == 0) ray.mask = 1u << random.below(3);
  return ray;
}

std::string where(unsigned i, const Ray& ray) {
  return "seed " + std::to_string(kSeed) + ", ray " + std::to_string(i) + "\n" + describe(ray);
}

template <class P> void check_cut_outs(const Textured& textured, const Scene& scene) {
  const CutOut cut_out{&textured};
  Random random(kSeed);
  std::size_t hits = 0, rejected = 0;
  for (unsigned i = 0; i < trials(300); ++i) {
    const Ray ray = random_ray(random);
    const std::vector<Hit> all = every_hit(textured.meshes, ray);
    const auto expected = kept(all, [&](const Hit& hit) { return cut_out(ray, hit) == FilterResult::kAccept; });
    hits += expected.size();
    rejected += all.size() - expected.size();
    INFO(scene.name << ", " << where(i, ray));
    REQUIRE(find_fault(Queries<P, CutOut>{scene.traced, cut_out}, ray, expected) == "");
  }
  CHECK(hits > trials(300));
  CHECK(rejected > trials(300));
}

/// The closest hit of exact arithmetic that is not cut out. @return false if rounding could decide whether the ray hits
/// that triangle or one before it.
bool exact_cut_out(const Textured& textured, const Ray& ray, std::uint32_t& geometry, std::uint32_t& primitive) {
  geometry = primitive = kInvalidId;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::uint32_t g = 0; g < textured.meshes.size(); ++g) {
    const Mesh& mesh = textured.meshes[g];
    if ((mesh.mask & ray.mask) == 0) continue;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const Corners c = corners(mesh, i);
      if (boundary_distance(ray, c) < 100) return false;
      const FilteredHit hit = decide(ray, c);
      if (!hit.hit) continue;
      if (std::abs(hit.t - nearest) < 1e-5) return false;
      if (hit.t > nearest) continue;
      const ExactPoint at = exact_point(ray, c);
      const double u = at.u.get_d(), v = at.v.get_d();
      const auto texture = [&](std::size_t k) {
        const auto corner = [&](std::size_t j) { return double{textured.uvs[g][mesh.triangles[i][j]][k]}; };
        return (1 - u - v) * corner(0) + u * corner(1) + v * corner(2);
      };
      const double alpha = Textured::alpha(texture(0), texture(1));
      if (std::abs(alpha) < 1e-2) return false;
      if (alpha < 0) continue;
      nearest = hit.t;
      geometry = g;
      primitive = i;
    }
  }
  return true;
}

}  // namespace

TEST_CASE("cut-outs from texture coordinates: closest, any and all hits", "[filters]") {
  const Textured textured = textured_soup();
  for (const build::Builder builder : typical_builders()) {
    for (const NodeLayout layout : kLayouts) {
      const Scene scene = make_scene(textured.meshes, {.builder = builder, .nodes = layout});
      dispatch_layout(layout, [&](auto tag) { check_cut_outs<Tried<decltype(tag)>>(textured, scene); });
    }
    const Scene scene = make_scene(textured.meshes, {.builder = builder});
    check_cut_outs<Tried<PlanesLayout, Postponed, ArrayLanes>>(textured, scene);
    check_cut_outs<Tried<PlanesLayout, Immediate, DefaultLanes, RestartStack<1>>>(textured, scene);
  }
}

TEST_CASE("the closest hit that is not cut out is that of exact arithmetic", "[filters]") {
  const Textured textured = textured_soup();
  const Scene scene = make_scene(textured.meshes);
  Random random(kSeed + 3);
  unsigned compared = 0, found = 0;
  for (unsigned i = 0; i < trials(1000); ++i) {
    const Ray ray = random_ray(random);
    std::uint32_t geometry = 0, primitive = 0;
    if (!exact_cut_out(textured, ray, geometry, primitive)) continue;
    ++compared;
    found += primitive != kInvalidId ? 1 : 0;
    PrivateStack<>::Memory memory;
    const Hit hit = ClosestHit<Tried<PlanesLayout>, CutOut>(scene.traced, ray, memory, {&textured}).next_hit();
    INFO(where(i, ray) << "\n" << describe(hit));
    REQUIRE(hit.geometry == geometry);
    REQUIRE(hit.primitive == primitive);
  }
  CHECK(compared > trials(1000) / 2);
  CHECK(found > trials(1000) / 4);
}

TEST_CASE("ExceptPrimitive: a ray that starts on a triangle skips it and hits all others", "[filters]") {
  // In planes of constant z points are exact. The two sheets lie in one another.
  const std::vector<Mesh> meshes{grid_plane(6, 2, 0.25f), grid_plane(6, 2, 0.25f), grid_plane(3, 2, 0.5f)};
  Random random(kSeed + 4);
  for (const build::Builder builder : typical_builders()) {
    const Scene scene = make_scene(meshes, {.builder = builder});
    unsigned others_at_0 = 0;
    for (unsigned i = 0; i < trials(2000); ++i) {
      const Vec3 from(random.uniform_float(-0.9, 0.9), random.uniform_float(-0.9, 0.9), 0.25f);
      PrivateStack<>::Memory memory;
      const Ray up{from, 0.0f, Vec3(0, 0, 1)};
      const Hit start = ClosestHit<Tried<PlanesLayout>>(scene.traced, up, memory).next_hit();
      // Along the plane the rounding of t decides whether the ray meets its own triangle.
      const bool steep = random.coin();
      const Ray ray{from, 0.0f, vec3(random.in_cube(1)) + Vec3(0, 0, steep ? 2.5f : 0.0f)};
      INFO(scene.name << ", " << where(i, ray));
      REQUIRE(start.t == 0);
      const ExceptPrimitive except{start.geometry, start.primitive};
      const auto expected = kept(every_hit(meshes, ray), [&](const Hit& hit) {
        return hit.geometry != start.geometry || hit.primitive != start.primitive;
      });
      REQUIRE(find_fault(Queries<Tried<PlanesLayout>, ExceptPrimitive>{scene.traced, except}, ray, expected) == "");
      if (!steep) continue;
      REQUIRE_FALSE(expected.empty());
      REQUIRE(expected[0].t == 0);
      ++others_at_0;
    }
    CHECK(others_at_0 > trials(2000) / 4);
  }
  // Nothing is excepted by default.
  const Scene scene = make_scene(meshes);
  const Ray ray{Vec3(0.1f, 0.2f, 1), 0.0f, Vec3(0, 0, -1)};
  CHECK(find_fault(Queries<Tried<PlanesLayout>, ExceptPrimitive>{scene.traced}, ray, every_hit(meshes, ray)) == "");
}

namespace {

/// Whether the candidates of a filter are hits of the list, apart from normal and error.
bool all_among(const std::vector<Hit>& seen, const std::vector<Hit>& hits) {
  return std::all_of(seen.begin(), seen.end(), [&](const Hit& hit) {
    return std::any_of(hits.begin(), hits.end(), [&](const Hit& other) { return same_hit(hit, other); });
  });
}

template <class P> void check_witness(const std::vector<Mesh>& meshes, const Scene& scene) {
  Random random(kSeed + 5);
  std::size_t looked_at = 0;
  for (unsigned i = 0; i < trials(400); ++i) {
    const Ray ray = random_ray(random);
    const std::vector<Hit> expected = every_hit(meshes, ray), bare = without_surface(expected);
    INFO(scene.name << ", " << where(i, ray));
    std::vector<Hit> seen;
    const Queries<P, Witness> accept{scene.traced, {&seen}};
    REQUIRE(same_hits(accept.closest(ray).hits, expected));
    REQUIRE(all_among(seen, bare));
    looked_at += seen.size();
    for (const bool all : {false, true}) {
      seen.clear();
      REQUIRE(sorted(all ? accept.all(ray).hits : accept.any(ray).hits).size() == expected.size());
      REQUIRE(same_hits(sorted(seen), bare));
    }
    const Queries<P, Witness> reject{scene.traced, {&seen, FilterResult::kReject}};
    for (const int query : {0, 1, 2}) {
      seen.clear();
      const Drained drained = query == 0 ? reject.closest(ray) : query == 1 ? reject.any(ray) : reject.all(ray);
      REQUIRE(drained.wrong == "");
      REQUIRE(drained.hits.empty());
      // Rejected candidates do not shorten the ray: even a closest-hit query passes all of them to the filter, each
      // once.
      REQUIRE(same_hits(sorted(seen), bare));
    }
  }
  CHECK(looked_at > trials(400));
}

}  // namespace

TEST_CASE("a filter gets candidates within the range, of visible geometries, without normal", "[filters]") {
  const Textured textured = textured_soup();
  for (const NodeLayout layout : kLayouts) {
    const Scene scene = make_scene(textured.meshes, {.builder = build::Builder::kSah, .nodes = layout});
    REQUIRE_FALSE(is_split(scene.traced));
    dispatch_layout(layout, [&](auto tag) { check_witness<Tried<decltype(tag)>>(textured.meshes, scene); });
  }
  const Scene scene = make_scene(textured.meshes, {.builder = build::Builder::kSah});
  check_witness<Tried<PlanesLayout, Postponed>>(textured.meshes, scene);
  check_witness<Tried<PlanesLayout, Postponed, ArrayLanes>>(textured.meshes, scene);
}

namespace {

/// Accept-and-stop at once: one candidate is seen, it is the hit, and there is no other.
template <class P> void check_first_stop(const std::vector<Mesh>& meshes, const Scene& scene) {
  Random random(kSeed + 6);
  for (unsigned i = 0; i < trials(400); ++i) {
    const Ray ray = random_ray(random);
    const std::vector<Hit> all = every_hit(meshes, ray);
    INFO(scene.name << ", " << where(i, ray));
    std::vector<Hit> seen;
    const Queries<P, Witness> queries{scene.traced, {&seen, FilterResult::kAcceptAndStop}};
    for (const int query : {0, 1, 2}) {
      seen.clear();
      const Drained drained = query == 0 ? queries.closest(ray) : query == 1 ? queries.any(ray) : queries.all(ray);
      REQUIRE(drained.wrong == "");
      REQUIRE(drained.hits.size() == (all.empty() ? 0 : 1));
      REQUIRE(same_hits(seen, without_surface(drained.hits)));
      REQUIRE(all_among(drained.hits, query == 1 ? without_surface(all) : all));
    }
  }
}

/// Stops at hits of geometry 1 only: every query gives some hits of others, and at most one of geometry 1, the last.
template <class P> void check_late_stop(const std::vector<Mesh>& meshes, const Scene& scene) {
  Random random(kSeed + 7);
  unsigned stopped = 0, late = 0;
  for (unsigned i = 0; i < trials(400); ++i) {
    const Ray ray = random_ray(random);
    const std::vector<Hit> all = every_hit(meshes, ray);
    const auto of_1 = kept(all, [](const Hit& hit) { return hit.geometry == 1; });
    INFO(scene.name << ", " << where(i, ray));
    std::vector<Hit> seen;
    const Queries<P, Witness> queries{scene.traced, {&seen, FilterResult::kAccept, 1}};
    for (const int query : {0, 1, 2}) {
      const Drained drained = query == 0 ? queries.closest(ray) : query == 1 ? queries.any(ray) : queries.all(ray);
      REQUIRE(drained.wrong == "");
      REQUIRE(all_among(drained.hits, query == 1 ? without_surface(all) : all));
      const auto last = kept(drained.hits, [](const Hit& hit) { return hit.geometry == 1; });
      REQUIRE(last.size() == (of_1.empty() ? 0 : 1));
      if (last.empty()) {
        REQUIRE((is_split(scene.traced) ? unique(drained.hits) : drained.hits).size() == all.size());
        continue;
      }
      REQUIRE(drained.hits.back().geometry == 1);
      ++stopped;
      late += drained.hits.size() > 1 ? 1 : 0;
    }
  }
  CHECK(stopped > trials(400) / 4);
  CHECK(late > 0);
}

}  // namespace

TEST_CASE("kAcceptAndStop ends the traversal with that hit", "[filters]") {
  const Textured textured = textured_soup();
  for (const build::Builder builder : {build::Builder::kSah, oracle::kEmbreeHigh}) {
    const Scene scene = make_scene(textured.meshes, {.builder = builder});
    check_first_stop<Tried<PlanesLayout>>(textured.meshes, scene);
    check_first_stop<Tried<PlanesLayout, Postponed>>(textured.meshes, scene);
    check_late_stop<Tried<PlanesLayout>>(textured.meshes, scene);
    check_late_stop<Tried<PlanesLayout, Postponed, ArrayLanes>>(textured.meshes, scene);
  }
}
