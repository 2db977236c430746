// Searches for the ray and triangle that come closest to a guaranteed bound. None may exceed it.

#include <tests/traversal/directed.h>

#include <hiprt_device/intersect/double_triangle_test.h>
#include <hiprt_device/intersect/exact_triangle_test.h>
#include <hiprt_device/query/spawn.h>
#include <hiprt_device/query/t_error.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

/// The hit point's distance from the triangle's plane, per axis, in Hit::error.
template <class Test, class Real> double point_share(const Case& it) {
  const auto hit = hit_of<Test, Real>(it);
  if (!hit || plane_sign(it.ray, it.corners) == 0) return -1.0;
  const detail::Volumes volumes = detail::volumes(it.ray, it.corners);
  // (t - exact t) d . n, over |n|_1: all as integers and rationals.
  const Rational off = abs(Rational(double{hit->t}) - quotient(volumes.distance, volumes.sum));
  const Integer3 a = detail::to_integer(it.corners.p0);
  const Integer3 n =
      cross(difference(detail::to_integer(it.corners.p1), a), difference(detail::to_integer(it.corners.p2), a));
  const Integer along = dot(detail::to_integer(position(it.ray.direction)), n),
                size = abs(n[0]) + abs(n[1]) + abs(n[2]);
  const Rational distance = off * quotient(abs(along), size);  // in units of 2^-149
  return Rational(distance / Rational(std::ldexp(double{hit->error}, kFloatScale))).get_d();
}

/// The distance of t from the exact one, in t_error().
template <class Test, class Real> double t_share(const Case& it) {
  const auto hit = hit_of<Test, Real>(it);
  if (!hit || plane_sign(it.ray, it.corners) == 0) return -1.0;
  const Real bound = t_error(SceneView{}, convert<Real>(it.ray), *hit);
  if (!(bound <= std::numeric_limits<Real>::max())) return 0.0;
  const Rational off = abs(Rational(double{hit->t}) - exact_point(it.ray, it.corners).t);
  return Rational(off / Rational(double{bound})).get_d();
}

/// Of the triangle's box.
template <class Test, class Real> double margin_share(const Case& it) {
  const auto hit = hit_of<Test, Real>(it);
  if (!hit || !(hit->t <= std::numeric_limits<Real>::max())) return -1.0;
  return box_share<Real>(convert<Real>(it.ray), box_of(it.corners), hit->t, 0.0f, 0.0f);
}

/// The error of Reference's t in units in its last place, or 2 for a wrong decision.
double reference_share(const Case& it) {
  const auto hit = hit_of<Reference, float>(it);
  const int side = plane_sign(it.ray, it.corners);
  const detail::Volumes volumes = detail::volumes(it.ray, it.corners);
  bool inside = side != 0, on_edge = false;
  for (const Integer& w : volumes.w) {
    inside = inside && sgn(w) * side >= 0;
    on_edge = on_edge || sgn(w) == 0;
  }
  if (on_edge || side == 0) return -1.0;  // Decided beside the line: test_reference.cpp.
  const Rational t = quotient(volumes.distance, volumes.sum);
  if (sgn(t) < 0 || nearest_float(t) == std::numeric_limits<float>::infinity()) return -1.0;
  if (hit.has_value() != inside) return 2.0;
  return hit ? error_in_ulps(hit->t, t) : -1.0;
}

/// Where t lies between the bounds that Reference gives before it decides exactly: 0 in the middle, 1 at a bound. 2
/// when the bounds reject a line that passes through the triangle.
double put_off_share(const Case& it) {
  const auto hit = hit_of<Reference, float>(it);
  if (!hit) return -1.0;
  const auto leaf = leaf_of(it.corners);
  const Reference::PreparedRay<ArrayLanes> prepared(it.ray);
  std::optional<Candidate> bounds;
  Reference::Bounds::intersect<ArrayLanes>(leaf, leaf.info, prepared, [&](const Candidate& at, unsigned slot) {
    if (slot == 0) bounds = at;
    return true;
  });
  if (!bounds) return 2.0;
  if (!std::isfinite(bounds->t) || !std::isfinite(bounds->u)) return -1.0;
  const Rational high(double{bounds->t}), low(double{bounds->u}),
      away = abs(2 * exact_point(it.ray, it.corners).t - high - low);
  return Rational(away / (high - low)).get_d();
}

/// A new ray's direction behind the genes of a case: along two edges and a little off the plane.
Genes make_leaving_genes(Random& random) {
  Genes genes = make_genes(random);
  genes.push_back(random.uniform_float(-1, 1));
  genes.push_back(random.uniform_float(-1, 1));
  genes.push_back(random.coin() ? 0.0f : static_cast<float>(random.log_uniform(1e-9, 1)));
  return genes;
}

/// The least part of Hit::error by which a ray that leaves has to be moved so that it does not meet the triangle again.
template <class Test, class Real> double spawn_share(const Genes& genes) {
  const auto it = case_of(genes);
  if (!it) return -1.0;
  const auto hit = hit_of<Test, Real>(*it);
  if (!hit || !(max_component(hit->normal) > 0.0f)) return -1.0;
  const auto corner = [](const Position& p) { return BasicVec3<Real>(p[0], p[1], p[2]); };
  const BasicVec3<Real> a = corner(it->corners.p0), along = corner(it->corners.p1) - a,
                        across = corner(it->corners.p2) - a;
  const BasicVec3<Real> n = BasicVec3<Real>(hit->normal) / Real(max_component(hit->normal));
  const Real extent = max_of(max_component(along), max_component(across));
  BasicRay<Real> leaving;
  leaving.direction = Real(genes[14]) * along + Real(genes[15]) * across + Real(genes[16]) * extent * n;
  if (!(max_component(leaving.direction) > Real(1e-9) * extent)) return -1.0;
  const BasicRay<Real> ray = convert<Real>(it->ray);
  const auto meets = [&](double part) {
    BasicHit<Real> moved = *hit;
    moved.error = static_cast<float>(part * double{hit->error});
    leaving.origin = spawn_origin(ray, moved, leaving.direction);
    return hit_of<Test>(it->corners, leaving).has_value();
  };
  return least_part([&](double part) { return !meets(part); });
}

/// point_share() or t_share() in long double.
template <class Test, bool kOfT> double quick_share(const Genes& genes) {
  using Long = long double;
  const auto it = case_of(genes);
  const auto hit = it ? hit_of<Test, float>(*it) : std::nullopt;
  if (!hit) return -1.0;
  std::array<Long, 3> from{}, edge1{}, edge2{}, n{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Long a = it->corners.p0[k];
    from[k] = a - it->ray.origin[static_cast<int>(k)];
    edge1[k] = it->corners.p1[k] - a;
    edge2[k] = it->corners.p2[k] - a;
  }
  Long along = 0, distance = 0, size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = edge1[i] * edge2[j] - edge1[j] * edge2[i];
    along += n[k] * it->ray.direction[static_cast<int>(k)];
    distance += n[k] * from[k];
    size += std::fabs(n[k]);
  }
  if (!(size > 0) || along == 0) return -1.0;
  const Long off = std::fabs(hit->t * along - distance);
  if (kOfT) return static_cast<double>(off / std::fabs(along) / t_error(SceneView{}, it->ray, *hit));
  return static_cast<double>(off / size / hit->error);
}

/// The error of the sheared, rounded edge functions, in the bound of Reference's filter.
double filter_share(const Genes& genes) {
  using Lanes = ArrayLanes;
  const auto it = case_of(genes);
  if (!it) return -1.0;
  const auto leaf = leaf_of(it->corners);
  const Reference::PreparedRay<Lanes> ray(it->ray);
  const ShearedVertices<Lanes> at(leaf, ray);
  const Rational bound(double{Reference::uncertainty<Lanes>(at, ray)});
  const auto direction = [&](unsigned axis) { return exact(it->ray.direction[static_cast<int>(axis)]); };
  Rational x[3], y[3];
  for (unsigned i = 0; i < 3; ++i) {
    const auto from = [&](unsigned axis) -> Rational {
      return exact(leaf.vertex[i][axis]) - exact(it->ray.origin[static_cast<int>(axis)]);
    };
    const Rational depth = from(ray.z) / direction(ray.z);
    x[i] = from(ray.x()) - direction(ray.x()) * depth;
    y[i] = from(ray.y()) - direction(ray.y()) * depth;
  }
  const auto next_x = Lanes::shuffle<1, 2, 0, 3>(at.x), next_y = Lanes::shuffle<1, 2, 0, 3>(at.y);
  const auto edges = difference_of_products<Lanes>(at.x, next_y, at.y, next_x);
  double most = 0.0;
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned j = (i + 1) % 3;
    const Rational off = abs(exact(Lanes::get(edges, i)) - (x[i] * y[j] - y[i] * x[j]));
    most = std::max(most, Rational(off / bound).get_d());
  }
  return most;
}

template <class Share> auto of_case(const Share& share) {
  return [=](const Genes& genes) {
    const auto it = case_of(genes);
    return it ? share(*it) : -1.0;
  };
}

template <class Share> void search(const char* what, const Share& share) {
  search_genes(what, make_genes, of_case(share));
}

}  // namespace

TEST_CASE("no search breaks the bound of the point", "[worst_cases]") {
  search("Watertight: Hit::error", point_share<Watertight, float>);
  search("Reference: Hit::error", point_share<Reference, float>);
  search("WatertightDouble: Hit::error", point_share<WatertightDouble, double>);
}

TEST_CASE("no search lets a spawned ray hit the triangle that it left", "[worst_cases]") {
  search_genes("Watertight: spawn_origin()", make_leaving_genes, spawn_share<Watertight, float>);
  search_genes("Reference: spawn_origin()", make_leaving_genes, spawn_share<Reference, float>);
  search_genes("WatertightDouble: spawn_origin()", make_leaving_genes, spawn_share<WatertightDouble, double>);
}

TEST_CASE("no search breaks the bound of t", "[worst_cases]") {
  search("Watertight: t_error()", t_share<Watertight, float>);
  search("Reference: t_error()", t_share<Reference, float>);
  search("WatertightDouble: t_error()", t_share<WatertightDouble, double>);
}

TEST_CASE("no search makes a box hide its triangle", "[worst_cases]") {
  search("Watertight: Conservative's margin", margin_share<Watertight, float>);
  search("Reference: Conservative's margin", margin_share<Reference, float>);
  search("WatertightDouble: margin", margin_share<WatertightDouble, double>);
}

TEST_CASE("no search makes Reference decide wrongly, or t worse than its last place", "[worst_cases]") {
  search("Reference: units of t", reference_share);
}

TEST_CASE("no search takes t out of the bounds of a deferred decision", "[worst_cases]") {
  search("Reference::Bounds", put_off_share);
}

TEST_CASE("directed searches reach these parts of the bounds of a triangle, and none breaks them", "[worst_cases]") {
  // The shears are about a half: their roundings are largest there.
  const auto sheared = [](Random& random) { return far_genes(random, 1024, 8192, 0.5f); };
  search_directed("Reference: filter", 8, 4000, 0.55, sheared, filter_share);
  search_directed("Watertight: Hit::error", 150, 8000, 0.2, small_genes, quick_share<Watertight, false>,
                  of_case(point_share<Watertight, float>));
  search_directed("Watertight: t_error()", 100, 8000, 0.2, small_genes, quick_share<Watertight, true>,
                  of_case(t_share<Watertight, float>));
  search_directed("Watertight: Conservative's margin", 40, 10000, 0.16, small_genes,
                  flat(of_case(margin_share<Watertight, float>)));
}
