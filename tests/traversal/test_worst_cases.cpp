// Searches for the ray and triangle that use up most of a bound that is promised: no one may use up all of it.

#include <hiprt_device/box_ray.h>
#include <hiprt_device/double_triangle_test.h>
#include <hiprt_device/exact_triangle_test.h>
#include <hiprt_device/format/instance_bounds.h>
#include <hiprt_device/primitives/computed_leaf.h>
#include <hiprt_device/spawn.h>
#include <hiprt_device/t_error.h>
#include <tests/oracle/hill_climb.h>
#include <tests/oracle/ray_triangle.h>
#include <tests/traversal/workers.h>

#include <catch2/catch.hpp>

#include <cstdio>
#include <optional>

using namespace hiprt;
using namespace hiprt::checks;
using namespace hiprt::oracle;

namespace {

constexpr std::uint64_t kSeed = 20261123;
constexpr unsigned kStarts = 40;

/// Three corners, an origin, and weights of the point that the ray is aimed at.
Genes make_genes(Random& random) {
  Genes genes;
  const double size = random.log_uniform(1e-3, 1e3), away = random.coin() ? 0.0 : random.log_uniform(1e-2, 1e5);
  for (unsigned i = 0; i < 12; ++i) genes.push_back(static_cast<float>(away + size * random.uniform(-1, 1)));
  genes.push_back(random.uniform_float(0, 1));
  genes.push_back(random.uniform_float(0, 1));
  return genes;
}

struct Case {
  Corners corners;
  Ray ray;
};

/// Nothing where numbers leave the range of the guarantees, or the triangle has no area.
std::optional<Case> case_of(const Genes& genes) {
  for (const float gene : genes)
    if (!std::isfinite(gene) || std::abs(gene) > 0x1p40f) return {};
  Case it;
  const auto position_at = [&](std::size_t i) { return Position{genes[i], genes[i + 1], genes[i + 2]}; };
  it.corners = {position_at(0), position_at(3), position_at(6)};
  it.ray.origin = Vec3(genes[9], genes[10], genes[11]);
  float largest = 0.0f;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double a = it.corners.p0[i], b = it.corners.p1[i], c = it.corners.p2[i];
    it.ray.direction[k] =
        static_cast<float>(a + double{genes[12]} * (b - a) + double{genes[13]} * (c - a) - double{it.ray.origin[k]});
    largest =
        std::max({largest, std::abs(genes[i]), std::abs(genes[3 + i]), std::abs(genes[6 + i]), std::abs(genes[9 + i])});
  }
  if (!is_valid(it.ray) || largest < 0x1p-40f || max_component(it.ray.direction) < 0x1p-60f * largest) return {};
  return it;
}

primitive_detail::ComputedLeaf<float> leaf_of(const Corners& of) {
  primitive_detail::ComputedLeaf<float> leaf{};
  const Position* corners[3] = {&of.p0, &of.p1, &of.p2};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) leaf.vertex[i][k] = (*corners[i])[k];
  leaf.info = {{0, kInvalidId}, 0, TriangleId::from_rotation(0)};
  return leaf;
}

/// What the test makes of the triangle, as a complete hit.
template <class Test, class Real> std::optional<BasicHit<Real>> hit_of(const Corners& of, const BasicRay<Real>& ray) {
  const auto leaf = leaf_of(of);
  const typename Test::template PreparedRay<ArrayLanes> prepared(ray);
  std::optional<BasicHit<Real>> found;
  Test::template intersect<ArrayLanes>(leaf, leaf.info, prepared, [&](const BasicCandidate<Real>& at, unsigned slot) {
    if (slot != 0 || !(at.t >= 0)) return true;
    BasicHit<Real> hit;
    hit.t = at.t, hit.u = at.u, hit.v = at.v, hit.primitive = 0;
    complete<primitive_detail::ComputedLeaves<float>>(hit, ray, leaf, 0);
    found = hit;
    return true;
  });
  return found;
}

template <class Test, class Real> std::optional<BasicHit<Real>> hit_of(const Case& it) {
  return hit_of<Test>(it.corners, convert<Real>(it.ray));
}

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

/// The least part of a margin that is enough; 0: none is needed.
template <class Enough> double least_part(const Enough& enough) {
  if (enough(0.0)) return 0.0;
  double low = 0.0, high = 16.0;
  for (unsigned i = 0; i < 12; ++i) {
    const double middle = 0.5 * (low + high);
    (enough(middle) ? high : low) = middle;
  }
  return high;
}

Box box_of(const Corners& corners) {
  Box box{};
  for (std::size_t k = 0; k < 3; ++k) {
    box.min[k] = std::min({corners.p0[k], corners.p1[k], corners.p2[k]});
    box.max[k] = std::max({corners.p0[k], corners.p1[k], corners.p2[k]});
  }
  return box;
}

/// The least part of Conservative's margin with which a box passes, with the hit as the limit. The box is all of its
/// file. Where none is needed it is in (-1, 0], and the larger the less the box may shrink: the search has a way to go.
/// @param condition, reach of the file's header.
template <class Real>
double box_share(const BasicRay<Real>& ray, const Box& box, Real t, float condition, float reach) {
  const BoxRay<Real> boxes(ray, box, t);
  const float margin =
      boxes.margin(Conservative::margin(boxes.ray(ray).origin, box, condition, reach), condition, reach);
  const auto passes = [&](double part) {
    const RaySlabs<ArrayLanes> slabs(boxes.ray(ray), static_cast<float>(part * double{margin}));
    return meets_box<ArrayLanes>(box, slabs, boxes.near_end(Real(0)), boxes.far_end(t));
  };
  if (!passes(0.0)) return least_part(passes);
  double low = -12.0, high = 40.0;  // Exponents of 2.
  for (unsigned i = 0; i < 12; ++i) {
    const double middle = 0.5 * (low + high);
    (passes(-std::exp2(middle)) ? low : high) = middle;
  }
  return -1.0 + 1.0 / (1.0 + std::exp2(low));
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

/// Where t is between the bounds with which Reference puts it off: 0 in the middle, 1 at one of them; or 2 where a line
/// that passes through the triangle is said to miss it.
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

/// A triangle in an instance, whose record is made of twelve more genes.
template <class Real> struct Placed {
  Case it;
  InstanceRecord record{};
  BasicRay<Real> ray, local;  ///< As the scene and as the object have it.
};

/// Nothing where numbers leave the range.
template <class Real> std::optional<Placed<Real>> placed_case(const Genes& genes) {
  Placed<Real> placed;
  InstanceRecord& record = placed.record;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) record.linear[r][c] = genes[14 + 3 * r + c];
    record.translation[r] = genes[23 + r];
  }
  const LinearInverse inverse(record);
  const auto it = case_of(genes);
  if (!inverse.exists() || !(inverse.norm() < 0x1p20) || !it) return {};
  placed.it = *it;
  // The genes' ray is the object's; the scene's is where the inverse takes it, rounded.
  Ray outside;
  outside.origin = point_to_scene(record, it->ray.origin);
  outside.direction = vector_to_scene(record, it->ray.direction);
  if (!is_valid(outside) || max_component(outside.origin) > 0x1p40f || max_component(outside.direction) < 0x1p-40f)
    return {};
  placed.ray = convert<Real>(outside);
  placed.local = ray_to_object(record, placed.ray);
  return placed;
}

/// Of the instance's box in the scene, as tight as the object's corners allow.
template <class Test, class Real> double instance_margin_share(const Genes& genes) {
  const auto placed = placed_case<Real>(genes);
  if (!placed) return -1.0;
  const auto& [it, record, ray, local] = *placed;
  const auto hit = hit_of<Test>(it.corners, local);
  if (!hit || !(hit->t <= std::numeric_limits<Real>::max())) return -1.0;
  const format_detail::StillPlace place(record);
  Box around = format_detail::empty_box();
  for (const Position& p : {it.corners.p0, it.corners.p1, it.corners.p2}) {
    const Box corner = place.bounds({{p[0], p[1], p[2]}, {p[0], p[1], p[2]}});
    for (std::size_t k = 0; k < 3; ++k) {
      around.min[k] = std::min(around.min[k], corner.min[k]);
      around.max[k] = std::max(around.max[k], corner.max[k]);
    }
  }
  format_detail::InstanceNeeds needs;
  needs.add(record, ObjectRecord{});
  return box_share<Real>(ray, around, hit->t, affine_detail::round_up(needs.condition),
                         affine_detail::round_up(needs.reach));
}

/// Of the triangle's box in the object's own tree.
template <class Test, class Real> double inner_margin_share(const Genes& genes) {
  const auto placed = placed_case<Real>(genes);
  if (!placed) return -1.0;
  const auto hit = hit_of<Test>(placed->it.corners, placed->local);
  if (!hit || !(hit->t <= std::numeric_limits<Real>::max())) return -1.0;
  return box_share<Real>(placed->local, box_of(placed->it.corners), hit->t, 0.0f, 0.0f);
}

/// The hit point's distance from the triangle's plane in the scene, per axis, in Hit::error.
template <class Test, class Real> double placed_share(const Genes& genes) {
  const auto placed = placed_case<Real>(genes);
  if (!placed) return -1.0;
  const auto& [it, record, ray, local] = *placed;
  const auto in_object = hit_of<Test>(it.corners, local);
  if (!in_object) return -1.0;
  ObjectRecord object{};
  SceneView scene;
  alignas(64) const std::byte nothing[64] = {};
  scene.base = nothing;
  scene.instances = &record;
  scene.objects = &object;
  BasicPathHit<Real, 1> hit;
  static_cast<BasicHit<Real>&>(hit) = *in_object;
  hit.path = {1, {0}};
  complete_along<false>(scene, hit, ray, [](const BasicRay<Real>&, const std::byte*) {});

  // The object's ray, exactly.
  const auto exact_of = [](double x) { return Rational(x); };
  std::array<Rational, 3> o, d, from, n;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const Rational entry = exact_of(double{record.linear[r][c]});
      o[static_cast<std::size_t>(r)] +=
          entry * (exact_of(double{ray.origin[c]}) - exact_of(double{record.translation[c]}));
      d[static_cast<std::size_t>(r)] += entry * exact_of(double{ray.direction[c]});
    }
  const Position &a = it.corners.p0, &b = it.corners.p1, &c = it.corners.p2;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    n[k] = (exact_of(b[i]) - exact_of(a[i])) * (exact_of(c[j]) - exact_of(a[j])) -
           (exact_of(b[j]) - exact_of(a[j])) * (exact_of(c[i]) - exact_of(a[i]));
    from[k] = o[k] + Rational(double{hit.t}) * d[k] - exact_of(a[k]);
  }
  Rational off, sum;
  for (std::size_t k = 0; k < 3; ++k) off += n[k] * from[k];
  for (std::size_t column = 0; column < 3; ++column) {
    Rational along;
    for (std::size_t row = 0; row < 3; ++row) along += exact_of(double{record.linear[row][column]}) * n[row];
    sum += abs(along);
  }
  if (sgn(sum) == 0) return -1.0;
  return Rational(abs(off) / sum / Rational(double{hit.error})).get_d();
}

Genes make_placed_genes(Random& random) {
  Genes genes = make_genes(random);
  for (unsigned i = 0; i < 9; ++i) genes.push_back(random.uniform_float(-2, 2));
  const double away = random.log_uniform(1e-2, 1e5);
  for (unsigned i = 0; i < 3; ++i) genes.push_back(static_cast<float>(away * random.uniform(-1, 1)));
  return genes;
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

template <class Make, class Score> void search_genes(const char* what, const Make& make, const Score& score) {
  const Worst worst = climb(kSeed, kStarts, trials(6000), make, score);
  std::printf("%-34s used up: %.3f of random cases, %.3f of those searched for\n", what, worst.random, worst.score);
  std::string text;
  for (const float gene : worst.genes) {
    char number[32];
    std::snprintf(number, sizeof number, "%a ", static_cast<double>(gene));
    text += number;
  }
  INFO(what << ", seed " << kSeed << ": " << text);
  CHECK(worst.score <= 1.0);
  // The search finds worse than chance does: it looks where it should.
  CHECK(worst.score >= worst.random);
}

template <class Share> void search(const char* what, const Share& share) {
  search_genes(what, make_genes, [&](const Genes& genes) {
    const auto it = case_of(genes);
    return it ? share(*it) : -1.0;
  });
}

}  // namespace

TEST_CASE("no search breaks the bound of the point", "[worst_cases]") {
  search("Watertight: Hit::error", point_share<Watertight, float>);
  search("Reference: Hit::error", point_share<Reference, float>);
  search("WatertightDouble: Hit::error", point_share<WatertightDouble, double>);
}

TEST_CASE("no search breaks the bound of a point seen through an instance", "[worst_cases]") {
  search_genes("Watertight in an instance", make_placed_genes, placed_share<Watertight, float>);
  search_genes("WatertightDouble in an instance", make_placed_genes, placed_share<WatertightDouble, double>);
}

TEST_CASE("no search lets a ray that leaves meet what it left", "[worst_cases]") {
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

TEST_CASE("no search makes a box hide what an instance has: its own, or one of its inner tree", "[worst_cases]") {
  search_genes("Watertight: an instance's margin", make_placed_genes, instance_margin_share<Watertight, float>);
  search_genes("Reference: an instance's margin", make_placed_genes, instance_margin_share<Reference, float>);
  search_genes("Double: an instance's margin", make_placed_genes, instance_margin_share<WatertightDouble, double>);
  search_genes("Watertight: an inner margin", make_placed_genes, inner_margin_share<Watertight, float>);
  search_genes("Reference: an inner margin", make_placed_genes, inner_margin_share<Reference, float>);
  search_genes("Double: an inner margin", make_placed_genes, inner_margin_share<WatertightDouble, double>);
}

TEST_CASE("no search makes Reference decide wrongly, or t worse than its last place", "[worst_cases]") {
  search("Reference: units of t", reference_share);
}

TEST_CASE("no search takes t out of the bounds with which it is put off", "[worst_cases]") {
  search("Reference::Bounds", put_off_share);
}
