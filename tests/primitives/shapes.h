#pragma once
/// Random spheres and round cones of every shape, and rays that hit them in every way.

#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <tests/oracle/random.h>
#include <tests/oracle/round_cone_distance.h>

#include <span>
#include <string>

namespace hiprt::checks {

using namespace hiprt::oracle;
using Point = std::array<double, 3>;

enum class Shape { kSphere, kLatticeSphere, kCylinder, kCone, kTip, kNeedle, kNearlyHeld, kHeld, kTouching, kLattice };
inline constexpr Shape kShapes[] = {Shape::kSphere,   Shape::kLatticeSphere, Shape::kCylinder,   Shape::kCone,
                                    Shape::kTip,      Shape::kNeedle,        Shape::kNearlyHeld, Shape::kHeld,
                                    Shape::kTouching, Shape::kLattice};

enum class Aim { kInner, kTangent, kSeam, kAxis, kMantleLine, kFromInside, kFromSurface, kBeside };
inline constexpr Aim kAims[] = {Aim::kInner,      Aim::kTangent,    Aim::kSeam,        Aim::kAxis,
                                Aim::kMantleLine, Aim::kFromInside, Aim::kFromSurface, Aim::kBeside};

inline const char* name(Shape shape) {
  constexpr const char* kNames[] = {"sphere", "lattice sphere", "cylinder", "cone",     "tip",
                                    "needle", "nearly held",    "held",     "touching", "lattice"};
  return kNames[static_cast<std::size_t>(shape)];
}
inline const char* name(Aim aim) {
  constexpr const char* kNames[] = {"inner",       "tangent",     "seam",         "axis",
                                    "mantle line", "from inside", "from surface", "beside"};
  return kNames[static_cast<std::size_t>(aim)];
}

inline bool is_sphere(Shape shape) { return shape == Shape::kSphere || shape == Shape::kLatticeSphere; }

/// How large everything is.
struct Scales {
  double size = 1.0;         ///< Of the primitive.
  double offset = 0.0;       ///< Distance of its center from the coordinates' origin, in sizes.
  double distance = 10.0;    ///< Largest distance of ray origins from their targets, in sizes.
  double direction = 1.0;    ///< Length of directions.
  double sizes = 1e10;       ///< Sizes and lengths of directions vary by factors
  double directions = 1e18;  ///< from 1 / this to this.
  bool per_size = false;     ///< Directions are measured in sizes.

  Scales varied(Random& random) const {
    Scales result = *this;
    result.size *= random.log_uniform(1 / sizes, sizes);
    result.direction *= random.log_uniform(1 / directions, directions) * (per_size ? result.size : 1);
    return result;
  }
};

struct Case {
  bool is_sphere;
  CurveVertex a, b;  ///< A sphere is in a.
  Ray ray;
};

inline Point point(const float (&p)[3]) { return {p[0], p[1], p[2]}; }
inline Point point(const Vec3& p) { return {p.x, p.y, p.z}; }
inline Vec3 rounded(const Point& p) {
  return Vec3(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
}
inline Point walk(const Point& a, double s, const Point& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}

/// The case in the oracle's terms.
inline LineAndBalls exact_terms(const Case& c) {
  const auto end = [](const CurveVertex& v) { return point(v.position); };
  return {point(c.ray.origin), point(c.ray.direction),        end(c.a), end(c.is_sphere ? c.a : c.b),
          c.a.radius,          c.is_sphere ? 0.0 : c.b.radius};
}

/// Balls of small integers.
inline LineAndBalls lattice_balls(Shape shape, Random& random) {
  LineAndBalls in{};
  for (Point* p : {&in.p0, &in.p1})
    for (double& x : *p) x = double(random.below(9)) - 4;
  in.r0 = random.below(4);
  in.r1 = in.r0 == 0 ? 1 + random.below(3) : random.below(4);
  if (shape == Shape::kLatticeSphere) in.p1 = in.p0, in.r0 = 1 + random.below(5), in.r1 = 0;
  return in;
}

/// The two balls of a shape of size about 1: centers in the cube [-1, 1]^3.
inline LineAndBalls random_balls(Shape shape, Random& random) {
  if (shape == Shape::kLattice || shape == Shape::kLatticeSphere) return lattice_balls(shape, random);
  LineAndBalls in{};
  for (Point* p : {&in.p0, &in.p1})
    for (double& x : *p) x = random.uniform(-1, 1);
  in.r0 = random.log_uniform(1e-3, 1);
  in.r1 = random.log_uniform(1e-3, 1);
  if (shape == Shape::kSphere) in.p1 = in.p0, in.r1 = 0;
  if (shape == Shape::kCylinder) in.r1 = in.r0;
  if (shape == Shape::kTip) in.r1 = 0;
  if (shape == Shape::kNeedle) {
    in.r0 = random.log_uniform(1e-7, 1e-4);
    in.r1 = random.coin() ? in.r0 * random.log_uniform(1e-6, 1) : random.coin() ? 0 : 1.5 * in.r0;
  }
  const double difference = std::abs(in.r1 - in.r0), further = random.log_uniform(1e-7, 0.5), part = random.unit();
  const Point away = random.on_sphere();
  if (shape == Shape::kNearlyHeld) in.p1 = walk(in.p0, difference * (1 + further), away);
  if (shape == Shape::kHeld) in.p1 = walk(in.p0, difference * part, away);
  if (shape == Shape::kTouching) in.p1 = walk(in.p0, in.r0 + in.r1, away);
  if (in.p0 != in.p1 && random.coin()) std::swap(in.r0, in.r1);
  return in;
}

/// A unit vector across a direction.
inline Point random_across(const Point& axis, Random& random) {
  for (;;) {
    const Point other = random.on_sphere();
    const Point c{axis[1] * other[2] - axis[2] * other[1], axis[2] * other[0] - axis[0] * other[2],
                  axis[0] * other[1] - axis[1] * other[0]};
    const double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    if (length > 1e-3 * std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]))
      return {c[0] / length, c[1] / length, c[2] / length};
  }
}

/// A point of the surface on the ball at s, with the outward normal there.
inline std::pair<Point, Point> surface_point(const LineAndBalls& in, double s, Random& random) {
  const Point w = walk(in.p1, -1, in.p0);
  const double length = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]), dr = in.r1 - in.r0;
  const Point center = walk(in.p0, s, w);
  const double radius = in.r0 + s * dr;
  Point normal = random.on_sphere();
  if (length > std::abs(dr)) {
    const double sine = -dr / length, cosine = std::sqrt((1 - sine) * (1 + sine));
    const Point across = random_across(w, random);
    for (std::size_t k = 0; k < 3; ++k) normal[k] = cosine * across[k] + sine * w[k] / length;
  }
  return {walk(center, radius, normal), normal};
}

/// A ray of unit size: from where, to where.
inline std::pair<Point, Point> random_aim(Aim aim, const LineAndBalls& in, double distance, Random& random) {
  const Point balls_apart = walk(in.p1, -1, in.p0);
  const Point w = in.p0 == in.p1 ? random.on_sphere() : balls_apart;
  const double s = aim == Aim::kSeam ? double(random.below(2)) : random.uniform(-0.1, 1.1);
  const double clamped = std::clamp(s, 0.0, 1.0), radius = in.r0 + clamped * (in.r1 - in.r0);
  const auto [on, normal] = surface_point(in, clamped, random);
  const Point inner = walk(walk(in.p0, clamped, balls_apart), radius * random.unit(), random.on_sphere());
  const double far = random.log_uniform(std::min(1e-2, 0.5 * distance), distance);
  const Point axis_point = walk(walk(in.p0, s, balls_apart), random.below(3) == 0 ? 0 : radius * random.uniform(0, 1.1),
                                random_across(w, random));
  const double sign = random.coin() ? 1 : -1;
  switch (aim) {
    case Aim::kInner:
      return {walk(inner, far, random.on_sphere()), inner};
    case Aim::kTangent:
      return {walk(on, far, random_across(normal, random)), on};
    case Aim::kSeam:
      return {walk(on, far, random.on_sphere()), on};
    case Aim::kAxis:
      return {walk(axis_point, sign * far, w), axis_point};
    case Aim::kMantleLine: {
      const Point other = surface_point(in, 1 - clamped, random).first;
      Point slope = w;
      for (std::size_t k = 0; k < 3; ++k) slope[k] += (in.r1 - in.r0) * normal[k];
      const Point end = random.below(4) == 0 ? other : walk(on, sign, slope);
      return {walk(end, 0.1 * random.unit() * radius, normal), on};
    }
    case Aim::kFromInside:
      return {inner, walk(inner, 1, random.on_sphere())};
    case Aim::kFromSurface:
      return {on, walk(on, 1, random.on_sphere())};
    case Aim::kBeside:
      return {walk(inner, far, random.on_sphere()), walk(inner, 2 * radius, random.on_sphere())};
  }
  return {};
}

inline Case random_case(Shape shape, Aim aim, const Scales& scales, Random& random) {
  LineAndBalls in = random_balls(shape, random);
  auto [from, to] = random_aim(aim, in, scales.distance, random);
  const bool lattice = (shape == Shape::kLattice || shape == Shape::kLatticeSphere) && random.coin();
  Point direction = walk(to, -1, from);
  const double length =
      std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
  // On the lattice all rounds to small integers, and the scale is a power of two: tangents and seams are met exactly.
  double size = scales.size, step = scales.direction / length;
  if (lattice) {
    size = std::exp2(std::nearbyint(std::log2(size)));
    step = std::exp2(std::nearbyint(std::log2(scales.direction)));
    for (std::size_t k = 0; k < 3; ++k) {
      from[k] = std::nearbyint(from[k]);
      direction[k] = std::nearbyint(4 * direction[k] / length);
    }
    if (direction == Point{0, 0, 0}) direction[random.below(3)] = 1;
  } else if (random.below(8) == 0) {
    direction[random.below(3)] = random.coin() ? 0.0 : -0.0;  // Turns the ray, about the target or not.
    if (direction[0] == 0 && direction[1] == 0 && direction[2] == 0) direction[0] = 1;
    from = walk(to, -1, direction);
  }
  const Point offset{scales.offset, -scales.offset, 0.5 * scales.offset};
  const auto moved = [&](const Point& p) { return rounded(walk(Point{0, 0, 0}, size, walk(p, 1, offset))); };
  const auto vertex = [&](const Point& p, double radius) {
    const Vec3 v = moved(p);
    return CurveVertex{{v.x, v.y, v.z}, static_cast<float>(radius * size)};
  };
  Case result{is_sphere(shape), vertex(in.p0, in.r0), vertex(in.p1, in.r1), {}};
  result.ray.origin = moved(from);
  result.ray.direction = rounded(walk(Point{0, 0, 0}, step, direction));
  result.ray.tmin = -std::numeric_limits<float>::max();
  return result;
}

/// Calls report(CustomHit) as the primitive's set does.
template <class Report> bool intersect(const Case& c, const Ray& ray, Report&& report) {
  if (c.is_sphere) {
    const Sphere sphere{{c.a.position[0], c.a.position[1], c.a.position[2]}, c.a.radius};
    return SphereSet{&sphere}.intersect(ray, ray.tmin, ray.tmax, 0, report);
  }
  const CurveVertex vertices[] = {c.a, c.b};
  constexpr std::uint32_t kFirst = 0;
  return RoundCurveSet{vertices, &kFirst}.intersect(ray, ray.tmin, ray.tmax, 0, report);
}

}  // namespace hiprt::checks
