#pragma once
/// The hits of a ray by a loop over all triangles in long double, and the check that a tracer's hit agrees within
/// rounding.

#include <hiprt_device/ray.h>
#include <tests/traversal/instances/moving_scenes.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace hiprt::checks {

inline Real3 operator-(const Real3& a, const Real3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Real dot(const Real3& a, const Real3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Real3 cross(const Real3& a, const Real3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Real length(const Real3& a) { return std::sqrt(dot(a, a)); }
inline Real3 real3(const Vec3& v) { return {v.x, v.y, v.z}; }

/// How far off a tracer may be, in the scene's units: distances of a ray from the edges of a triangle and its plane.
struct Tolerances {
  double ours = 0.0, theirs = 0.0;
};

/// A tracer's result; primitive kInvalidId: a miss.
struct TracedHit {
  std::uint32_t instance = kInvalidId, primitive = kInvalidId;
  float t = 0.0f;

  bool found() const { return primitive != kInvalidId; }
  friend bool operator==(const TracedHit& a, const TracedHit& b) {
    return a.primitive == b.primitive && a.instance == b.instance;
  }
};

/// A triangle that the ray meets, or may seem to meet.
struct MetTriangle {
  std::uint32_t instance = kInvalidId, primitive = kInvalidId;
  bool inside = false;
  Real boundary = 0;   ///< Distance of the ray's line from the triangle's boundary.
  Real t = 0;          ///< Where the ray is in the plane.
  Real steepness = 0;  ///< How far it gets from the plane per unit of t.
  Tolerances tolerances{};
};

/// All triangles about one ray, of no limited range.
class RayJudge {
 public:
  explicit RayJudge(const Ray& ray) : origin_(real3(ray.origin)), direction_(real3(ray.direction)) {
    unsigned least = 0;
    for (unsigned i = 1; i < 3; ++i)
      if (std::fabs(direction_[i]) < std::fabs(direction_[least])) least = i;
    Real3 axis{};
    axis[least] = 1;
    across_[0] = cross(direction_, axis);
    across_[1] = cross(direction_, across_[0]);
    for (Real3& v : across_) {
      const Real size = length(v);
      for (Real& x : v) x /= size;
    }
  }

  void add(std::uint32_t instance, std::uint32_t primitive, const std::array<Real3, 3>& corners,
           const Tolerances& tolerances) {
    std::array<Real3, 3> seen;
    Real flat[3][2];  // In the plane across the ray, which is 0 there.
    for (unsigned k = 0; k < 3; ++k) {
      seen[k] = corners[k] - origin_;
      for (unsigned i = 0; i < 2; ++i) flat[k][i] = dot(seen[k], across_[i]);
    }
    MetTriangle met{instance, primitive, true, std::numeric_limits<Real>::infinity(), 0, 0, tolerances};
    bool positive = true, negative = true;
    for (unsigned k = 0; k < 3; ++k) {
      const Real(&a)[2] = flat[k], (&b)[2] = flat[(k + 1) % 3];
      const Real area = a[0] * b[1] - a[1] * b[0];
      positive = positive && area >= 0;
      negative = negative && area <= 0;
      met.boundary = std::min(met.boundary, distance(a, b));
    }
    met.inside = positive || negative;
    if (!met.inside && met.boundary > std::max(tolerances.ours, tolerances.theirs)) return;
    const Real3 normal = cross(seen[1] - seen[0], seen[2] - seen[0]);
    met.t = dot(normal, seen[0]) / dot(normal, direction_);
    met.steepness = std::fabs(dot(normal, direction_)) / length(normal);
    if (met.inside && met.t * met.steepness < -std::max(tolerances.ours, tolerances.theirs)) return;
    met_.push_back(met);
  }

  /// Of the ray's line from a point.
  Real distance(const Real3& point) const { return length(cross(point - origin_, direction_)) / length(direction_); }

  /// The triangle that the result names; nullptr: none, or one that the ray misses by a distance.
  const MetTriangle* met(const TracedHit& hit) const {
    for (const MetTriangle& met : met_)
      if (met.instance == hit.instance && met.primitive == hit.primitive) return &met;
    return nullptr;
  }

  /// The fault of a result, or "".
  /// @param tolerance which of a triangle's.
  std::string fault(const TracedHit& hit, double Tolerances::*tolerance) const {
    char text[200];
    const MetTriangle* named = met(hit);
    Real slack = 0;
    if (hit.found()) {
      if (named == nullptr || (!named->inside && named->boundary > named->tolerances.*tolerance))
        return "the ray passes the triangle";
      slack = named->tolerances.*tolerance / named->steepness;
      if (!(std::fabs(hit.t - named->t) <= slack)) {
        std::snprintf(text, sizeof text, "t is %.9g, not %.9Lg, which may be off by %.3Lg", static_cast<double>(hit.t),
                      named->t, slack);
        return text;
      }
    }
    for (const MetTriangle& met : met_) {
      const Real allowed = met.tolerances.*tolerance;
      if (!met.inside || met.boundary <= allowed || met.t * met.steepness <= allowed) continue;
      if (hit.found() && hit.t <= met.t + slack + allowed / met.steepness) continue;
      std::snprintf(text, sizeof text,
                    "instance %u, triangle %u at t %.9Lg is missed, %.3Lg from its edge, allowed %.3Lg", met.instance,
                    met.primitive, met.t, met.boundary, allowed);
      return text;
    }
    return {};
  }

 private:
  static Real distance(const Real (&a)[2], const Real (&b)[2]) {
    const Real edge[2] = {b[0] - a[0], b[1] - a[1]}, square = edge[0] * edge[0] + edge[1] * edge[1];
    const Real s = square > 0 ? std::clamp(-(a[0] * edge[0] + a[1] * edge[1]) / square, Real{0}, Real{1}) : Real{0};
    return std::hypot(a[0] + s * edge[0], a[1] + s * edge[1]);
  }

  Real3 origin_, direction_, across_[2];
  std::vector<MetTriangle> met_;
};

/// What many rays have shown.
struct SecondOpinion {
  std::uint64_t rays = 0, hits = 0, differ = 0;
  std::uint64_t any_differs = 0;  ///< Our any hit says other than our closest hit.
  std::uint64_t our_faults = 0, their_faults = 0;
  std::string first_fault;
  /// Of hits on the right triangle: the error of t, measured across the triangle's plane. The unit is 2^-24 of the
  /// ray's length up to the hit plus its origin's distance from 0.
  std::vector<double> our_errors, their_errors;
  double our_most = 0.0, their_most = 0.0;  ///< Share of the allowed error, also beyond an edge.

  void judge(const RayJudge& judge, const Ray& ray, const TracedHit& ours, const TracedHit& theirs) {
    ++rays;
    hits += ours.found() ? 1 : 0;
    differ += ours == theirs ? 0 : 1;
    const std::string our = judge.fault(ours, &Tolerances::ours), their = judge.fault(theirs, &Tolerances::theirs);
    our_faults += our.empty() ? 0 : 1;
    their_faults += their.empty() ? 0 : 1;
    if (first_fault.empty() && !(our.empty() && their.empty()))
      first_fault = "ray " + std::to_string(rays - 1) + ": " + (our.empty() ? "Embree: " + their : "we: " + our);
    measure(judge, ray, ours, &Tolerances::ours, our_errors, our_most);
    measure(judge, ray, theirs, &Tolerances::theirs, their_errors, their_most);
  }

  /// Demands (Catch2) that nothing is unexplained, and prints a row.
  void check(const char* name) {
    std::sort(our_errors.begin(), our_errors.end());
    std::sort(their_errors.begin(), their_errors.end());
    std::printf("%-26s %7lu %7lu %6lu | %7.2f %8.1f %6.3f | %7.2f %10.1f %6.3f\n", name, rays, hits, differ,
                median(our_errors), most(our_errors), our_most, median(their_errors), most(their_errors), their_most);
    INFO(name << ": " << first_fault);
    CHECK(our_faults == 0);
    CHECK(their_faults == 0);
    CHECK(any_differs == 0);
    CHECK(hits > rays / 10);
    CHECK(differ < rays / 5);
  }
  static void print_header() {
    std::printf("%-26s %7s %7s %6s | %7s %8s %6s | %7s %10s %6s\n", "error of t in 2^-24", "rays", "hits", "differ",
                "ours", "largest", "of it", "Embree", "largest", "of it");
  }

 private:
  static double median(const std::vector<double>& values) { return values.empty() ? 0.0 : values[values.size() / 2]; }
  static double most(const std::vector<double>& values) { return values.empty() ? 0.0 : values.back(); }

  static void measure(const RayJudge& judge, const Ray& ray, const TracedHit& hit, double Tolerances::*tolerance,
                      std::vector<double>& errors, double& most) {
    const MetTriangle* met = hit.found() ? judge.met(hit) : nullptr;
    if (met == nullptr) return;
    if (!met->inside) {
      most = std::max(most, static_cast<double>(met->boundary / met->tolerances.*tolerance));
      return;
    }
    const Real distance = std::fabs(hit.t - met->t) * met->steepness;
    most = std::max(most, static_cast<double>(distance / met->tolerances.*tolerance));
    const Real whole = length(real3(ray.origin)) + met->t * length(real3(ray.direction));
    errors.push_back(static_cast<double>(distance / whole * 0x1p24L));
  }
};

}  // namespace hiprt::checks
