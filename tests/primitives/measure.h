#pragma once
/// Measures the errors of computed crossings against exact ones.

#include <tests/primitives/shapes.h>
#include <tests/traversal/workers.h>

#include <cstdio>

namespace hiprt::checks {

/// Lines this near to a tangent, in units of the primitive's size, may hit or miss. Their crossing may be anywhere
/// where the line is this near to the surface.
inline constexpr double kTangentBand = 0x1p-50;
/// Beyond half a unit in the last place, t is off by at most this many sizes over the cosine of the angle of incidence.
inline constexpr double kSlack = 0x1p-49;

/// The rounding error bound of one shape and aim, and the largest measured error.
struct Findings {
  std::uint64_t cases = 0, hits = 0, odd_counts = 0, wrong = 0, in_band = 0, out_of_order = 0;
  double widest_band = 0;   ///< Largest distance of a wrongly decided line from being a tangent, in sizes.
  std::vector<float> ulps;  ///< Errors of t at angles of incidence with a cosine beyond 2^-10.
  double slack = 0;         ///< Largest error of t beyond half a unit: see kSlack, in 2^-53.
  double surface = 0;       ///< Largest distance of a computed point from the surface, in CustomHit::error.
  double bound = 0;         ///< Largest CustomHit::error, in 2^-24 of the largest coordinate or distance.
  double normal = 0;        ///< Largest error of a normal, in 2^-24.
  double parameter = 0;     ///< Largest error of a curve's u: see parameter_error.
  std::string first_failure;

  void add(Findings&& other) {
    cases += other.cases, hits += other.hits, odd_counts += other.odd_counts;
    wrong += other.wrong, in_band += other.in_band, out_of_order += other.out_of_order;
    widest_band = std::max(widest_band, other.widest_band);
    ulps.insert(ulps.end(), other.ulps.begin(), other.ulps.end());
    slack = std::max(slack, other.slack), surface = std::max(surface, other.surface);
    bound = std::max(bound, other.bound), normal = std::max(normal, other.normal);
    parameter = std::max(parameter, other.parameter);
    if (first_failure.empty()) first_failure = std::move(other.first_failure);
  }
  /// @return the error that this part of the hits does not exceed.
  double quantile(double part) {
    if (ulps.empty()) return 0;
    const auto index = static_cast<std::size_t>(part * static_cast<double>(ulps.size() - 1));
    std::nth_element(ulps.begin(), ulps.begin() + static_cast<std::ptrdiff_t>(index), ulps.end());
    return ulps[index];
  }
};

inline std::string describe(const Case& c) {
  char text[400];
  const auto &a = c.a.position, &b = c.b.position;
  std::snprintf(text, sizeof(text), "%s (%a %a %a) r %a, (%a %a %a) r %a; ray from (%a %a %a) along (%a %a %a)",
                c.is_sphere ? "sphere" : "curve", a[0], a[1], a[2], c.a.radius, b[0], b[1], b[2], c.b.radius,
                c.ray.origin.x, c.ray.origin.y, c.ray.origin.z, c.ray.direction.x, c.ray.direction.y,
                c.ray.direction.z);
  return text;
}

inline Real size_of(const LineAndBalls& in) { return norm(minus(real3(in.p1), real3(in.p0))) + std::max(in.r0, in.r1); }

/// How deep the line dips into the solid, in scene units; negative: how far it passes it. The distance along the line
/// is convex: golden section, around the point nearest to p0, which is computed without rounding.
inline Real depth(const LineAndBalls& in) {
  const auto lift = [](double a, double b) { return Rational(Rational(a) - Rational(b)); };
  std::array<Rational, 3> y;
  Rational dd = 0, yd = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    y[k] = lift(in.origin[k], in.p0[k]);
    dd += Rational(in.direction[k]) * Rational(in.direction[k]);
    yd += y[k] * Rational(in.direction[k]);
  }
  const Real length = norm(real3(in.direction));
  Real3 from{}, direction{};
  LineAndBalls moved = in;
  for (std::size_t k = 0; k < 3; ++k) {
    const Rational v = y[k] - yd / dd * Rational(in.direction[k]);
    from[k] = Real{v.get_d()} + Real{Rational(v - Rational(v.get_d())).get_d()};
    direction[k] = in.direction[k] / length;
    moved.p0[k] = 0;
    moved.p1[k] = in.p1[k] - in.p0[k];
  }
  const auto distance = [&](Real t) { return distance_to_surface(moved, plus(from, t, direction)).value; };
  Real low = -2 * size_of(in), high = -low;
  for (int i = 0; i < 200; ++i) {
    const Real a = low + 0.382L * (high - low), b = low + 0.618L * (high - low);
    (distance(a) < distance(b) ? high : low) = distance(a) < distance(b) ? b : a;
  }
  return -distance(low);
}

/// The error of a curve's u, in sizes, beyond the errors of the point and of rounding u to a float. The exact u names
/// the ball of the sweep that touches the surface at the hit: the ball nearest to the point.
inline double parameter_error(const LineAndBalls& in, const Real3& at, const CustomHit& hit) {
  const Real3 w = minus(real3(in.p1), real3(in.p0));
  const Real radius = in.r0 + Real{hit.u} * (Real{in.r1} - in.r0), size = size_of(in);
  const Real gap = std::abs(norm(minus(at, plus(real3(in.p0), hit.u, w))) - radius);
  return static_cast<double>((gap - 2 * Real{hit.error}) / size);
}

/// The radius of the sweep at the foot of a point on the axis.
inline Real radius_beside(const LineAndBalls& in, const Real3& at) {
  const Real3 w = minus(real3(in.p1), real3(in.p0));
  const Real squared = inner(w, w);
  if (squared == 0) return std::max(in.r0, in.r1);
  const Real s = std::clamp<Real>(inner(minus(at, real3(in.p0)), w) / squared, 0, 1);
  return in.r0 + s * (Real{in.r1} - in.r0);
}

/// One crossing against the exact one.
inline void measure_crossing(const Case& c, const LineAndBalls& in, const CustomHit& hit, const Rational& exact_t,
                             Findings& findings) {
  const Real3 d = real3(in.direction);
  const Real length = norm(d), size = size_of(in);
  const double rounded = exact_t.get_d(), rest = Rational(exact_t - Rational(rounded)).get_d();
  const Real3 at = plus(plus(real3(in.origin), rounded, d), rest, d);
  const SurfaceDistance there = distance_to_surface(in, at);
  const Real radius = radius_beside(in, at);
  // A tip has no normal; where the radius is small, the normal lacks the digits that the size of the primitive takes.
  const Real cosine = radius < 0x1p-40L * size ? 0 : std::abs(inner(there.gradient, d)) / length;
  const Real gap = norm(minus(Real3{hit.normal.x, hit.normal.y, hit.normal.z}, there.gradient));
  const double normal = static_cast<double>(gap * std::min<Real>(1, radius / size * 0x1p20L)) * 0x1p24;
  // Near 0, t is as good as the size of the primitive allows.
  const double least = static_cast<double>(0x1p-20L * size / length);
  const double ulps = error_in_ulps(hit.t, exact_t, std::max(std::abs(rounded), least));
  const double beyond = std::max(0.0, absolute_error(hit.t, exact_t) - 0.5 * ulp(rounded));
  const double slack = cosine > 0x1p-16L ? static_cast<double>(beyond * length * cosine / size) * 0x1p53 : 0;
  const double parameter = c.is_sphere ? 0 : parameter_error(in, at, hit);
  const bool is_bad = slack > kSlack * 0x1p53 || parameter > 0x1p-22;
  // Lines in the band may cross the surface anywhere near it, which measure_point looks at. Asked seldom: it is slow.
  if ((is_bad || normal > 1 || cosine < 0x1p-16L) && depth(in) <= kTangentBand * size) return;
  if (cosine > 0x1p-10L) findings.ulps.push_back(static_cast<float>(ulps));
  findings.slack = std::max(findings.slack, slack);
  findings.normal = std::max(findings.normal, cosine > 0x1p-16L ? normal : 0);
  findings.parameter = std::max(findings.parameter, parameter);
  if (is_bad && findings.first_failure.empty()) findings.first_failure = "crossing: " + describe(c);
}

/// The computed point and the promised bound of its distance from the surface.
inline void measure_point(const Case& c, const LineAndBalls& in, const CustomHit& hit, Findings& findings) {
  const Ray& ray = c.ray;
  const Vec3 fused(std::fma(hit.t, ray.direction.x, ray.origin.x), std::fma(hit.t, ray.direction.y, ray.origin.y),
                   std::fma(hit.t, ray.direction.z, ray.origin.z));
  const volatile float px = hit.t * ray.direction.x, py = hit.t * ray.direction.y, pz = hit.t * ray.direction.z;
  const Vec3 plain(ray.origin.x + px, ray.origin.y + py, ray.origin.z + pz);
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k)
    largest = std::max({largest, std::abs(in.origin[k]), std::abs(in.p0[k]) + in.r0, std::abs(in.p1[k]) + in.r1,
                        std::abs(hit.t * in.direction[k])});
  findings.bound = std::max(findings.bound, hit.error / (largest * 0x1p-24));
  for (const Vec3& p : {fused, plain}) {
    const SurfaceDistance s = distance_to_surface(in, real3(point(p)));
    // A box of half width error around the point reaches this far along the normal.
    const Real reach = hit.error * (std::abs(s.gradient[0]) + std::abs(s.gradient[1]) + std::abs(s.gradient[2]));
    const double needed = static_cast<double>(std::abs(s.value) / reach);
    if (!(needed <= 1) && findings.first_failure.empty()) findings.first_failure = "point: " + describe(c);
    findings.surface = std::max(findings.surface, needed == needed ? needed : 1e30);
  }
}

/// The library's own intersect(), for measure().
struct Ours {
  template <class Report> bool operator()(const Case& c, const Ray& ray, Report&& report) const {
    return intersect(c, ray, report);
  }
};

template <class Intersect> void measure(const Case& c, const Intersect& intersects, Findings& findings) {
  const LineAndBalls in = exact_terms(c);
  const auto exact = cross_exactly(in);
  std::vector<CustomHit> hits;
  intersects(c, c.ray, [&](const CustomHit& hit) {
    hits.push_back(hit);
    return true;
  });
  ++findings.cases;
  if (hits.size() != 0 && hits.size() != 2) {
    ++findings.odd_counts;
    findings.first_failure = "odd count: " + describe(c);
    return;
  }
  if (exact.has_value() != (hits.size() == 2)) {
    const double off = static_cast<double>(std::abs(depth(in)) / size_of(in));
    findings.widest_band = std::max(findings.widest_band, off);
    (off <= kTangentBand ? findings.in_band : findings.wrong) += 1;
    if (off > kTangentBand && findings.first_failure.empty()) findings.first_failure = "decision: " + describe(c);
  }
  if (hits.empty()) return;
  ++findings.hits;
  if (hits[0].t > hits[1].t) ++findings.out_of_order;
  for (const CustomHit& hit : hits) measure_point(c, in, hit, findings);
  if (!exact) return;
  measure_crossing(c, in, hits[0], exact->enter, findings);
  measure_crossing(c, in, hits[1], exact->exit, findings);
}

/// Measures cases of a shape and aim, in parallel.
template <class Intersect = Ours>
Findings measure_many(Shape shape, Aim aim, const Scales& scales, std::uint64_t seed, unsigned count,
                      const Intersect& intersects = {}) {
  constexpr unsigned kBlock = 250;
  const auto work = [&](std::size_t block, Findings& findings) {
    Random random(
        Random(seed + (static_cast<std::uint64_t>(shape) << 56 | static_cast<std::uint64_t>(aim) << 48 | block << 16))
            .bits());
    for (unsigned i = 0; i < kBlock; ++i) {
      measure(random_case(shape, aim, scales.varied(random), random), intersects, findings);
    }
  };
  Findings sum;
  for (Findings& part : for_each_parallel<Findings>(count / kBlock + 1, work)) sum.add(std::move(part));
  return sum;
}

}  // namespace hiprt::checks
