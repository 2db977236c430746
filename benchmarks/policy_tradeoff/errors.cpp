#include "errors.h"

#include <tests/oracle/brute_force.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <algorithm>
#include <cmath>

namespace hiprt::bench {
namespace {

constexpr std::uint64_t kSeed = 20261123;

using oracle::Random;

enum class Aim { kEdge, kVertex, kInside };

Vec3 vec(const oracle::Double3& p) {
  return Vec3(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
}

/// A point of the triangle: a corner, on an edge or inside.
oracle::Double3 aimed_at(const oracle::Corners& corners, Aim aim, Random& random) {
  double u = 0.0, v = 0.0;
  if (aim == Aim::kEdge) u = random.unit();
  if (aim == Aim::kInside) {
    u = random.unit(), v = random.unit();
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
  }
  oracle::Double3 p{};
  for (std::size_t k = 0; k < 3; ++k)
    p[k] = corners.p0[k] + u * (double{corners.p1[k]} - corners.p0[k]) + v * (double{corners.p2[k]} - corners.p0[k]);
  return p;
}

/// Rays that start up to @p reach times the mesh's extent from its centre. Rays that miss in exact arithmetic are
/// left out.
ErrorCase make_case(Model model, Aim aim, double reach, unsigned rays) {
  ErrorCase result;
  result.model = std::move(model);
  const oracle::Mesh mesh{result.model.mesh.positions, result.model.mesh.triangles};
  Random random(kSeed);
  const Vec3 c = result.model.centre;
  // Few rays miss.
  for (unsigned tries = 0; result.rays.size() < rays && tries < 20 * rays; ++tries) {
    const std::size_t triangle = random.below(static_cast<std::uint32_t>(mesh.triangles.size()));
    const oracle::Double3 at = aimed_at(oracle::corners(mesh, triangle), aim, random);
    const oracle::Double3 away = random.on_sphere();
    const double distance = reach * double{result.model.extent} * random.uniform(0.5, 1.0);
    Ray ray;
    ray.origin = vec({c.x + distance * away[0], c.y + distance * away[1], c.z + distance * away[2]});
    ray.direction = vec({at[0] - ray.origin.x, at[1] - ray.origin.y, at[2] - ray.origin.z});
    const oracle::ExactClosest truth = oracle::closest({&mesh, 1}, ray);
    if (!truth.found) continue;
    result.rays.push_back(ray);
    result.truths.push_back({truth.primitive, truth.where.t});
  }
  return result;
}

struct PointError {
  double distance;  ///< From the plane, in scene units.
  double unit;      ///< In the last place of the largest coordinate.
};

PointError point_error(const Ray& ray, const Hit& hit, const oracle::Corners& corners) {
  using namespace oracle;
  const Vec3 point = spawn_detail::moved(ray.origin, hit.t, ray.direction);
  const Integer3 a = detail::to_integer(corners.p0);
  const Integer3 n =
      cross(difference(detail::to_integer(corners.p1), a), difference(detail::to_integer(corners.p2), a));
  const Integer along = dot(n, difference(detail::to_integer(position(point)), a));
  // Squared, in units of 2^-149. A rational, because the normal can exceed the range of double.
  const Rational squared = quotient(along * along, dot(n, n));
  const double largest = double{std::max(max_component(ray.origin), max_component(point))};
  return {std::ldexp(std::sqrt(squared.get_d()), -kFloatScale), ulp(largest)};
}

/// Whether the ray hits the triangle at exactly the t of the closest one. They share an edge or a corner then.
bool as_close(const Ray& ray, const oracle::Corners& corners, const oracle::Corners& closest) {
  return oracle::decide_in_integers(ray, corners).hit && oracle::compare_t(ray, corners, closest) == 0;
}

}  // namespace

Spread spread(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto last = static_cast<double>(values.size() - 1);
  return {values[values.size() / 2], values[static_cast<std::size_t>(std::ceil(0.999 * last))], values.back()};
}

std::vector<ErrorCase> error_cases(unsigned rays) {
  const oracle::Mesh star = oracle::star(4, 11), sphere = oracle::icosphere(4);
  std::vector<ErrorCase> cases;
  const auto add = [&](const char* name, const oracle::Mesh& mesh, Aim aim, double room, double scale = 1.0,
                       const oracle::Double3& offset = {0, 0, 0}) {
    // From inside of closed meshes, else from around the mesh.
    cases.push_back(make_case(make_model(name, mesh, room, scale, offset), aim, room > 0.0 ? 0.5 * room : 3.0, rays));
  };
  add("edges", star, Aim::kEdge, 0.05);
  add("vertices", star, Aim::kVertex, 0.05);
  add("insides", sphere, Aim::kInside, 0.5);
  add("needles 6e5", oracle::needles(1000, 6e5, 5), Aim::kInside, 0.0);
  add("needles 6e7", oracle::needles(1000, 6e7, 6), Aim::kInside, 0.0);
  add("slivers 1e-6", oracle::slivers(1000, 1e-6, 7), Aim::kInside, 0.0);
  add("radius 10 at 1e3", sphere, Aim::kEdge, 0.5, 10.0, {1e3, 1e3, 1e3});
  add("radius 1e3 at 1e7", sphere, Aim::kEdge, 0.5, 1e3, {1e7, -1e7, 1e7});
  add("size 1e-15", star, Aim::kEdge, 0.05, 1e-15);
  add("size 1e15", star, Aim::kEdge, 0.05, 1e15);
  add("size 1e-30", star, Aim::kEdge, 0.05, 1e-30);
  return cases;
}

Errors measure_errors(const ErrorCase& errors, std::span<const Hit> hits, bool has_bounds) {
  Errors result;
  std::vector<double> t, u, v, point;
  const oracle::Mesh mesh{errors.model.mesh.positions, errors.model.mesh.triangles};
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit& hit = hits[i];
    const ErrorCase::Truth& truth = errors.truths[i];
    ++result.rays;
    if (!hit.found()) {
      ++result.missed;
      continue;
    }
    if (!(std::abs(double{hit.t} - truth.t) <= 0.01 * truth.t)) ++result.wrong;
    const oracle::Corners corners = oracle::corners(mesh, hit.primitive);
    if (hit.primitive != truth.primitive &&
        !as_close(errors.rays[i], corners, oracle::corners(mesh, truth.primitive))) {
      ++result.other;
      continue;
    }
    const oracle::ExactPoint exact = oracle::exact_point(errors.rays[i], corners);
    t.push_back(oracle::error_in_ulps(hit.t, exact.t));
    u.push_back(oracle::absolute_error(hit.u, exact.u) * 0x1p24);
    v.push_back(oracle::absolute_error(hit.v, exact.v) * 0x1p24);
    const PointError off = point_error(errors.rays[i], hit, corners);
    point.push_back(off.distance / off.unit);
    if (has_bounds && off.distance > 1.7321 * double{hit.error}) ++result.beyond_bound;
  }
  result.t = spread(std::move(t));
  result.u = spread(std::move(u));
  result.v = spread(std::move(v));
  result.point = spread(std::move(point));
  return result;
}

}  // namespace hiprt::bench
