// Accuracy of hits in instances, and their error bounds.

#include <hiprt_device/math/vec_functions.h>
#include <tests/traversal/instances/instance_scenes.h>

#include <algorithm>
#include <cstdio>

using namespace hiprt;
using namespace hiprt::checks;
using hiprt::oracle::Random;

namespace {

constexpr std::uint64_t kSeed = 20261122;

template <class LayoutType, unsigned kLevels> struct Tracer : Instanced<WithLayout<LayoutType>, kLevels> {};

/// The exact closest hit, of the transforms and triangles as they stand in the file.
struct ExactHit {
  double t = std::numeric_limits<double>::infinity();
  double margin = 0.0;     ///< Of the smallest weight: near 0 the ray passes an edge.
  double steepness = 0.0;  ///< How far the ray gets from the triangle's plane, in the scene, per unit of t.
};

/// The scalar triple products of Moller and Trumbore, in long double: independent of the library's test.
ExactHit exact_hit(const std::vector<const InstanceRecord*>& records, const oracle::Mesh& mesh, const Ray& ray) {
  using Real = long double;
  using Real3 = std::array<Real, 3>;
  const auto cross = [](const Real3& a, const Real3& b) {
    return Real3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto dot = [](const Real3& a, const Real3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  Real3 o{ray.origin.x, ray.origin.y, ray.origin.z}, d{ray.direction.x, ray.direction.y, ray.direction.z};
  for (const InstanceRecord* record : records) {
    Real3 inner_o{}, inner_d{};
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) {
        inner_o[r] += Real{record->linear[r][c]} * (o[c] - Real{record->translation[c]});
        inner_d[r] += Real{record->linear[r][c]} * d[c];
      }
    o = inner_o;
    d = inner_d;
  }
  ExactHit best;
  for (const oracle::Triangle& triangle : mesh.triangles) {
    Real3 p[3];
    for (unsigned k = 0; k < 3; ++k)
      for (unsigned axis = 0; axis < 3; ++axis) p[k][axis] = mesh.positions[triangle[k]][axis];
    Real3 e1, e2, s;
    for (unsigned axis = 0; axis < 3; ++axis) {
      e1[axis] = p[1][axis] - p[0][axis];
      e2[axis] = p[2][axis] - p[0][axis];
      s[axis] = o[axis] - p[0][axis];
    }
    const Real3 h = cross(d, e2), q = cross(s, e1);
    const Real determinant = dot(e1, h), u = dot(s, h) / determinant, v = dot(d, q) / determinant,
               t = dot(e2, q) / determinant;
    const Real margin = std::min({u, v, 1 - u - v});
    if (!(margin >= 0) || !(t >= 0) || !(t < best.t)) continue;
    Real3 normal = cross(e1, e2);
    const Real along = dot(normal, d);
    for (std::size_t i = records.size(); i-- > 0;) {
      Real3 outer{};
      for (unsigned r = 0; r < 3; ++r)
        for (unsigned c = 0; c < 3; ++c) outer[c] += Real{records[i]->linear[r][c]} * normal[r];
      normal = outer;
    }
    best = {static_cast<double>(t), static_cast<double>(margin),
            static_cast<double>(std::fabs(along) / std::sqrt(dot(normal, normal)))};
  }
  return best;
}

/// @p levels nested instances, each this far from its scene's origin.
InstanceScene chain(std::uint64_t seed, unsigned levels, double translation, double stretch = 1.0) {
  Random random(seed);
  InstanceScene scene;
  scene.add_file({oracle::icosphere(3)}, NodeLayout::kPlanes);
  for (unsigned level = 0; level < levels; ++level) {
    const auto away = random.on_sphere();
    scene.groups.push_back(
        {{.object = level,
          .to_scene = affine(random.on_sphere(), random.uniform(0, 6.3), {1.0, 1.0, stretch},
                             {translation * away[0], translation * away[1], translation * away[2]})}});
  }
  scene.build();
  return scene;
}

/// Where the chain's innermost origin is in the scene.
Vec3 innermost(const InstanceScene& scene) {
  Vec3 p(0.0f);
  for (const auto& group : scene.groups) {
    const auto& m = group[0].to_scene.row;
    const auto row = [&](unsigned r) {
      return static_cast<float>(double{m[r][0]} * p.x + double{m[r][1]} * p.y + double{m[r][2]} * p.z + m[r][3]);
    };
    p = Vec3(row(0), row(1), row(2));
  }
  return p;
}

std::vector<const InstanceRecord*> records_along_path(const InstanceScene& scene, const SceneView& view) {
  InstancePath<kMostLevels> path;
  path.depth = static_cast<std::uint32_t>(scene.groups.size());
  std::vector<const InstanceRecord*> records;
  follow<false>(view, path, 0.0f, [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord*) {
    records.push_back(&record);
  });
  return records;
}

/// Rays from the scene at a sphere that may be far away: the hits, the accuracy of t, and whether the error bounds
/// hold. @return the median and the largest error of t in 2^-24 of it, and the largest part of a bound that is used up.
std::array<double, 3> check_exactness(const InstanceScene& scene, std::uint64_t seed, unsigned rays) {
  using P = Tracer<PlanesLayout, kMostLevels>;
  const SceneView view = scene.view();
  const auto records = records_along_path(scene, view);
  const oracle::Mesh mesh = oracle::icosphere(3);
  const Vec3 center = innermost(scene);
  Random random(seed);
  std::vector<double> errors;
  double tightest = 0.0;
  for (unsigned i = 0; i < rays; ++i) {
    const auto from = random.on_sphere();
    const auto at = random.in_cube(0.7);
    const auto away = random.uniform_float(3, 10);
    Ray ray;
    ray.origin = center + away * Vec3(from[0], from[1], from[2]);
    ray.direction = center + Vec3(at[0], at[1], at[2]) - ray.origin;
    const ExactHit exact = exact_hit(records, mesh, ray);
    const auto hit = closest_hit<P>(view, ray);
    // Near an edge the rounded ray may hit the neighbouring facet: the exact t is then not comparable.
    if (exact.margin < 1e-3) continue;
    INFO("ray " << i << ", exact t " << exact.t);
    REQUIRE(hit.found());
    const double distance = std::fabs(double{hit.t} - exact.t);
    REQUIRE(distance * exact.steepness <= 1.7321 * double{hit.error});
    REQUIRE(distance <= double{t_error(view, ray, hit)});
    tightest = std::max(tightest, distance * exact.steepness / double{hit.error});
    errors.push_back(distance / exact.t * 0x1p24);
  }
  REQUIRE(errors.size() > rays / 3);
  std::sort(errors.begin(), errors.end());
  return std::array{errors[errors.size() / 2], errors.back(), tightest};
}

}  // namespace

TEST_CASE("t is exact far from the origin, on many levels and through uneven scales") {
  const auto report = [](const char* what, const std::array<double, 3>& errors) {
    std::printf("error of t, in 2^-24 of it: %-28s median %6.2f, largest %6.1f; of the bound %.4f\n", what, errors[0],
                errors[1], errors[2]);
    return errors[0];
  };
  CHECK(report("translation 1", check_exactness(chain(kSeed, 1, 1), kSeed, 2000)) < 1);
  CHECK(report("translation 1e3", check_exactness(chain(kSeed, 1, 1e3), kSeed, 2000)) < 1);
  CHECK(report("translation 1e5", check_exactness(chain(kSeed, 1, 1e5), kSeed, 2000)) < 1);
  CHECK(report("16 levels, 1 each", check_exactness(chain(kSeed, 16, 1), kSeed, 2000)) < 12);
  CHECK(report("scale 1e-3 along an axis", check_exactness(chain(kSeed, 1, 1, 1e-3), kSeed, 2000)) < 50);
}

TEST_CASE("rays that start on a surface in instances do not hit it again") {
  for (const double translation : {1.0, 1e3, 1e5}) {
    const InstanceScene scene = chain(kSeed + 1, 2, translation);
    using P = Tracer<PlanesLayout, 2>;
    const SceneView view = scene.view();
    const Vec3 center = innermost(scene);
    Random random(kSeed);
    unsigned spawned = 0;
    for (unsigned i = 0; i < 5000; ++i) {
      const auto from = random.on_sphere(), out = random.on_sphere();
      const auto at = random.in_cube(0.6);
      Ray ray;
      ray.origin = center + 4.0f * Vec3(from[0], from[1], from[2]);
      ray.direction = center + Vec3(at[0], at[1], at[2]) - ray.origin;
      const auto hit = closest_hit<P>(view, ray);
      if (!hit.found()) continue;
      Ray next;
      next.direction = Vec3(out[0], out[1], out[2]);
      if (glm::dot(next.direction, hit.normal) < 0) next.direction = -next.direction;
      next.origin = spawn_origin(ray, hit, next.direction);
      // Outside a ball there is nothing.
      REQUIRE(glm::dot(ray.direction, hit.normal) < 0);
      REQUIRE_FALSE(closest_hit<P>(view, next).found());
      ++spawned;
    }
    CHECK(spawned > 2000);
  }
}

TEST_CASE("round_up() and round_down() give the next float beyond, at every magnitude") {
  using affine_detail::round_down, affine_detail::round_up;
  Random random(kSeed);
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kMax = std::numeric_limits<float>::max();
  for (unsigned i = 0; i < 100000; ++i) {
    const float x = random.any_float();
    if (!std::isfinite(x)) continue;
    const double above = std::nextafter(double{x}, double{kInfinity}),
                 below = std::nextafter(double{x}, -double{kInfinity});
    INFO("seed " << kSeed << ", float " << x);
    REQUIRE(round_up(x) == x);
    REQUIRE(round_down(x) == x);
    REQUIRE(round_up(above) == std::nextafter(x, kInfinity));
    REQUIRE(round_up(below) == x);
    REQUIRE(round_down(below) == std::nextafter(x, -kInfinity));
    REQUIRE(round_down(above) == x);
  }
  for (const double tiny : {5e-324, 1e-60}) {
    CHECK(round_up(tiny) == 0x1p-149f);
    CHECK(round_up(-tiny) == 0.0f);
    CHECK(round_down(-tiny) == -0x1p-149f);
    CHECK(round_down(tiny) == 0.0f);
  }
  CHECK(round_up(1e300) == kInfinity);
  CHECK(round_down(1e300) == kMax);
  CHECK(round_up(-1e300) == -kMax);
  CHECK(round_down(-1e300) == -kInfinity);
}

TEST_CASE("stretches are the singular values that the matrices were made of") {
  Random random(kSeed);
  double worst = 0.0;
  for (unsigned i = 0; i < 20000; ++i) {
    // Rotations in double with scales between them. Two scales may be equal.
    const auto rotation = [&](double(&m)[3][3]) {
      const auto x = random.on_sphere(), other = random.on_sphere();
      const double along = x[0] * other[0] + x[1] * other[1] + x[2] * other[2];
      double length = 0.0;
      for (unsigned k = 0; k < 3; ++k) {
        m[0][k] = x[k];
        m[1][k] = other[k] - along * x[k];
        length += m[1][k] * m[1][k];
      }
      for (double& y : m[1]) y /= std::sqrt(length);
      for (unsigned k = 0; k < 3; ++k)
        m[2][k] = m[0][(k + 1) % 3] * m[1][(k + 2) % 3] - m[0][(k + 2) % 3] * m[1][(k + 1) % 3];
      return length > 1e-6;
    };
    double first[3][3], second[3][3], product[3][3];
    if (!rotation(first) || !rotation(second)) continue;
    const double size = random.log_uniform(1e-20, 1e20);
    double scale[3] = {size, size * random.log_uniform(1e-3, 1), 0};
    scale[2] = i % 3 == 0 ? scale[1] : size * random.log_uniform(1e-3, 1);
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 3; ++c) {
        product[r][c] = 0.0;
        for (unsigned k = 0; k < 3; ++k) product[r][c] += first[k][r] * scale[k] * second[k][c];
      }
    const Stretches stretches(product);
    INFO("seed " << kSeed << ", matrix " << i);
    REQUIRE(stretches.longest == Approx(size).epsilon(1e-12));
    const double shortest = std::min(scale[1], scale[2]), error = std::fabs(stretches.shortest / shortest - 1);
    // Half of the digits go into the square.
    worst = std::max(worst, error * shortest * shortest / (size * size));
  }
  std::printf("shortest stretch: off by at most %.2g of the longest, squared\n", worst);
  CHECK(worst < 1e-14);
}
