// The error bound of t holds against exact arithmetic and is not much larger than necessary. Policies without a surface
// find the same hits.

#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/query/double_rays.h>
#include <hiprt_device/query/query.h>
#include <hiprt_device/query/t_error.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261123;

/// From a point near the mesh to a random point of it. One ray in four lies nearly in the plane of its target.
Ray ray_at(const Mesh& mesh, Random& random, double scale, const Double3& offset) {
  const Double3 to = target_point(mesh, random), away = random.on_sphere();
  const double reach = scale * random.log_uniform(0.1, 100);
  Ray ray;
  Double3 from{};
  for (std::size_t k = 0; k < 3; ++k) from[k] = offset[k] + reach * away[k];
  if (random.below(4) == 0) {
    const Double3 other = target_point(mesh, random);
    for (std::size_t k = 0; k < 3; ++k) from[k] = other[k] + 1e-3 * scale * away[k];
  }
  ray.origin = vec3(rounded(from));
  for (int k = 0; k < 3; ++k) ray.direction[k] = static_cast<float>(to[static_cast<std::size_t>(k)] - ray.origin[k]);
  return ray;
}

struct Used {
  unsigned hits = 0, endless = 0;
  double most = 0.0;
  std::vector<double> tightness;  ///< Of |t - exact| / bound.
};

template <class P> void look(const Scene& scene, const Mesh& mesh, const Ray& ray, Used& used) {
  const auto own = convert<typename P::Real>(ray);
  const auto hit = closest_hit<P>(scene.traced, own);
  if (!hit.found()) return;
  ++used.hits;
  const auto bound = t_error(scene.traced, own, hit);
  REQUIRE(bound > 0);
  if (bound > std::numeric_limits<decltype(bound)>::max()) {
    ++used.endless;
    return;
  }
  const Rational truth = exact_point(ray, corners(mesh, hit.primitive)).t;
  const Rational off = abs(Rational(double{hit.t}) - truth);
  const double share = Rational(off / Rational(double{bound})).get_d();
  used.tightness.push_back(share);
  used.most = std::max(used.most, share);
}

template <class P> void check(const char* what) {
  Used used;
  Random random(kSeed);
  for (const Mesh& unit : {icosphere(3), star(4, 7), oracle::needles(300, 1e4, 5), oracle::slivers(300, 1e-5, 7)})
    for (const auto& [scale, offset] :
         {std::pair{1.0, Double3{}}, {1e-20, Double3{}}, {1e15, Double3{}}, {10.0, Double3{1e3, -1e3, 500}}}) {
      const Mesh mesh = oracle::placed(unit, scale, offset);
      const Scene scene = make_scene({mesh});
      for (unsigned i = 0; i < trials(600); ++i) {
        const Ray ray = ray_at(mesh, random, scale, offset);
        INFO(what << " scale " << scale << ", ray " << i);
        look<P>(scene, mesh, ray, used);
      }
    }
  REQUIRE(used.tightness.size() > used.hits / 2);
  std::sort(used.tightness.begin(), used.tightness.end());
  std::printf("bound of t, %-10s: %u hits, %u without a bound; used up: median %.4f, most %.3f\n", what, used.hits,
              used.endless, used.tightness[used.tightness.size() / 2], used.most);
  CHECK(used.most <= 1.0);
}

/// Everything but normals and errors.
struct Exact : Policies {
  using Triangle = Reference;
};
struct Bare : Policies {
  static constexpr bool kSurface = false;
};

}  // namespace

TEST_CASE("t is within its bound", "[t_error]") {
  INFO("seed " << kSeed);
  check<Policies>("default");
  check<Exact>("Reference");
  check<DoubleRays<>>("double");
}

TEST_CASE("a ray in the plane of its hit has no bound of t", "[t_error]") {
  Hit hit;
  hit.primitive = 0;
  hit.normal = Vec3(0, 0, 2);
  hit.error = 1e-6f;
  Ray ray;
  ray.direction = Vec3(1, 0.5f, 0);
  CHECK(t_error(SceneView{}, ray, hit) == std::numeric_limits<float>::infinity());
  ray.direction = Vec3(1, 0.5f, 1e-7f);
  CHECK(t_error(SceneView{}, ray, hit) == std::numeric_limits<float>::infinity());
  ray.direction = Vec3(0, 0, 4);
  CHECK(t_error(SceneView{}, ray, hit) == Approx(0.25e-6f).epsilon(1e-4));
  hit.normal = Vec3(0.0f);
  CHECK(t_error(SceneView{}, ray, hit) == std::numeric_limits<float>::infinity());
}

TEST_CASE("hits without a surface differ only in normal and error", "[t_error]") {
  const Mesh mesh = icosphere(3);
  const Scene scene = make_scene({mesh});
  Random random(kSeed);
  for (unsigned i = 0; i < trials(2000); ++i) {
    const Ray ray = ray_at(mesh, random, 1.0, {});
    const Hit full = closest_hit<Policies>(scene.traced, ray), bare = closest_hit<Bare>(scene.traced, ray);
    REQUIRE((bare.t == full.t && bare.u == full.u && bare.v == full.v && bare.primitive == full.primitive));
    REQUIRE((bare.error == 0.0f && bare.normal == Vec3(0.0f)));
    if (full.found()) REQUIRE((full.error > 0.0f && full.normal != Vec3(0.0f)));
  }
}
