#pragma once
/// Spheres and round curves: crossings against exact ones, smallest boxes, traversal against brute force, spawned rays.

#include <hiprt_build/shapes.h>
#include <hiprt_device/primitives/scene_shapes.h>
#include <hiprt_device/query/spawn.h>
#include <tests/flags/spawned.h>
#include <tests/primitives/digest.h>
#include <tests/primitives/measure.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace hiprt::flags {

inline constexpr float kLargest = std::numeric_limits<float>::max();

inline ShapePoint shape_point(const Vec3& at, float radius) { return {{at.x, at.y, at.z}, radius}; }

/// Two balls on the lattice: any, of the same radius, with a tip, one in the other, or touching.
inline std::array<ShapePoint, 2> two_balls(Random& random) {
  const Vec3 a = lattice_point(random, 4096), step = lattice_point(random, 2048);
  const float r = (1.0f + static_cast<float>(random.below(1024))) * kLattice, other = coordinate(random, 1024);
  const std::uint32_t kind = random.below(6);
  std::array<ShapePoint, 2> balls{shape_point(a, r), shape_point(a + step, std::fabs(other))};
  if (kind == 1) balls[1].radius = r;
  if (kind == 2) balls[1].radius = 0.0f;
  if (kind == 3) balls[1] = shape_point(a + step * 0x1p-10f, r * 0.5f);
  if (kind == 4) balls[1] = shape_point(a + Vec3(0, 0, 2.0f * r), r);
  if (kind == 5) balls[1].radius = r * 0x1p-8f;
  if (random.coin()) std::swap(balls[0], balls[1]);
  return balls;
}

/// From near or far, from the surface of a ball or its middle, to the inside, to where a box touches, or beside.
inline Aim aim_at_balls(const std::array<ShapePoint, 2>& balls, Random& random) {
  const ShapePoint& ball = balls[random.below(2)];
  const Vec3 center(ball.position[0], ball.position[1], ball.position[2]);
  const int axis = static_cast<int>(random.below(3));
  const float sign = random.coin() ? 1.0f : -1.0f;
  const std::uint32_t from_kind = random.below(8), to_kind = random.below(4);
  Vec3 pole = center;
  pole[axis] += sign * ball.radius;
  const Vec3 near = lattice_point(random, 8192), beside = lattice_point(random, 1024);
  const float far = std::ldexp(1.0f, static_cast<int>(random.below(16)));
  Aim aim{center + near, to_kind == 0 ? pole : center + beside, power(random, 20)};
  if (to_kind == 1) aim.to = center + beside * (ball.radius > 0.0f ? 0x1p-4f : 0.0f);
  if (from_kind == 0) aim.from = pole;
  if (from_kind == 1) aim.from = center;
  if (from_kind == 2) aim.from = center + near * far;
  // A tangent of the ball, exactly.
  if (to_kind == 0) aim.from[axis] = pole[axis];
  if (max_component(aim.to - aim.from) == 0.0f) aim.to[axis] += 1.0f;
  return aim;
}

inline Hit as_hit(const CustomHit& hit) {
  Hit result;
  result.t = hit.t;
  result.u = hit.u;
  result.v = hit.v;
  result.normal = hit.normal;
  result.error = hit.error;
  result.geometry = result.primitive = 0;
  return result;
}

/// A ray that leaves a shape outwards at a hit does not meet it again; one that enters it leaves it once.
inline void expect_spawned(Check& check, const checks::Case& shape, const Hit& hit, Random& random) {
  checks::Case next = shape;
  next.ray = Ray{};
  const std::uint32_t kind = random.below(4);
  const Vec3 anywhere = lattice_point(random, 4096);
  const Vec3 axis(shape.b.position[0] - shape.a.position[0], shape.b.position[1] - shape.a.position[1],
                  shape.b.position[2] - shape.a.position[2]);
  const float sign = random.coin() ? 1.0f : -1.0f, length = power(random, 10);
  Vec3 direction = anywhere;
  if (kind == 0) direction = hit.normal * sign;
  if (kind == 1) direction = axis * sign;
  if (kind == 2) direction = axis * sign + anywhere * 0x1p-12f;
  if (max_component(direction) == 0.0f) direction.x = 1.0f;
  next.ray.direction = direction * length;
  next.ray.origin = spawn_origin(shape.ray, hit, next.ray.direction);
  check.put_out(next.ray);
  unsigned crossings = 0;
  checks::intersect(next, next.ray, [&](const CustomHit& again) {
    check.put_out(as_hit(again));
    ++crossings;
    return true;
  });
  const oracle::LineAndBalls in = checks::exact_terms(next);
  const Vec3 normal = divided(hit.normal, max_component(hit.normal));
  if (spawn_detail::dot(normal, next.ray.direction) >= 0.0f)
    check.expect(crossings == 0, "a ray spawned outwards crosses it %u times: %s", crossings, describe(next).c_str());
  else if (distance_to_surface(in, oracle::real3(in.origin)).value < -0x1p-46L * checks::size_of(in))
    // Not where the shape is thinner than the error, and the ray starts on its other side.
    check.expect(crossings == 1, "a ray spawned inwards crosses it %u times: %s", crossings, describe(next).c_str());
}

/// What docs/GUARANTEES.md says of spheres and round curves, and of rays that leave them.
inline unsigned shapes_against_exact() {
  Check check("shapes against exact crossings", kSeed + 13);
  Random random(kSeed + 13), of_directions(kSeed + 14);
  constexpr unsigned kShapes = 2000;
  for (unsigned i = 0; i < kShapes; ++i) {
    const auto balls = two_balls(random);
    checks::Case shape{i % 3 == 0, balls[0], balls[1], aim_at_balls(balls, random).ray()};
    if (shape.a.radius == 0.0f) std::swap(shape.a, shape.b);
    shape.ray.tmin = -kLargest;
    check.on_ray(shape.ray);
    for (const ShapePoint& ball : balls) {
      check.put_in(Vec3(ball.position[0], ball.position[1], ball.position[2]));
      check.put_in(ball.radius);
    }
    std::vector<Hit> hits;
    checks::intersect(shape, shape.ray, [&](const CustomHit& hit) {
      hits.push_back(as_hit(hit));
      return true;
    });
    check.on_hit(hits.empty() ? Hit{} : hits[0]);
    for (const Hit& hit : hits) {
      check.put_out(hit);
      expect_spawned(check, shape, hit, of_directions);
    }
    checks::Findings f;
    checks::measure(shape, checks::Ours{}, f);
    const std::string what = describe(shape);
    check.expect(f.odd_counts == 0, "crossed an odd number of times: %s", what.c_str());
    check.expect(f.out_of_order == 0, "the exit comes before the entry: %s", what.c_str());
    check.expect(f.wrong == 0, "decided as a line that is %.3g sizes away: %s", f.widest_band, what.c_str());
    check.expect(f.slack <= checks::kSlack * 0x1p53, "t is off by %.3g * 2^-53 sizes more than its rounding: %s",
                 f.slack, what.c_str());
    check.expect(f.surface <= 1, "a point is %.3f errors off the surface: %s", f.surface, what.c_str());
    check.expect(f.normal <= 8, "a normal is off by %.3f * 2^-24: %s", f.normal, what.c_str());
    check.expect(f.parameter <= 0x1p-22, "u names a ball that is %.3g sizes off: %s", f.parameter, what.c_str());
  }
  return check.finish(kShapes / 3);
}

/// The digest that tests/primitives and a GPU print, too.
inline unsigned shapes_of_any_size() {
  Check check("shapes of any size", 0);
  std::uint64_t digest = 0;
  for (std::uint32_t i = 0; i < checks::kDigestCases; ++i) digest += checks::digest_case(i);
  check.put_out(static_cast<std::uint32_t>(digest));
  check.put_out(static_cast<std::uint32_t>(digest >> 32));
  check.expect(digest == checks::kDigest, "the digest of tests/primitives/digest.h is %llx here, %llx elsewhere",
               static_cast<unsigned long long>(digest), static_cast<unsigned long long>(checks::kDigest));
  return check.finish();
}

/// Boxes are the smallest that floats allow around shapes of all sizes, at distances of other sizes.
inline unsigned boxes_of_shapes() {
  Check check("boxes of shapes", kSeed + 15);
  Random random(kSeed + 15);
  const auto number = [&] {
    const auto mantissa = static_cast<float>(integer(random, 0xffffff));
    return mantissa * power(random, 16);
  };
  for (unsigned i = 0; i < 4000; ++i) {
    ShapePoint ball[2];
    for (ShapePoint& b : ball) {
      for (float& x : b.position) x = number();
      b.radius = std::fabs(number()) + 0x1p-16f;
    }
    const Sphere sphere{{ball[0].position[0], ball[0].position[1], ball[0].position[2]}, ball[0].radius};
    const Box of_sphere = SphereSet::bounds(sphere), of_curve = RoundCurveSet::bounds(ball[0], ball[1]);
    check.put_out(of_sphere);
    check.put_out(of_curve);
    for (unsigned axis = 0; axis < 3; ++axis) {
      // Sums of two floats that are at most 2^32 times each other: exact.
      const auto side = [&](unsigned which, long double sign) {
        return static_cast<long double>(ball[which].position[axis]) +
               sign * static_cast<long double>(ball[which].radius);
      };
      const auto is_low = [&](float x, long double bound) {
        return static_cast<long double>(x) <= bound && static_cast<long double>(std::nextafter(x, kLargest)) > bound;
      };
      const auto expect_sides = [&](const char* of, const Box& box, long double low, long double high) {
        check.expect(is_low(box.min[axis], low) && is_low(-box.max[axis], -high),
                     "box %u: [%a, %a] on axis %u of a %s from %La to %La", i, double{box.min[axis]},
                     double{box.max[axis]}, axis, of, low, high);
      };
      expect_sides("sphere", of_sphere, side(0, -1), side(0, 1));
      expect_sides("curve", of_curve, std::min(side(0, -1), side(1, -1)), std::max(side(0, 1), side(1, 1)));
    }
  }
  return check.finish();
}

/// Spheres (geometry 0) and curves (1), as this program and its file have them.
class ShapeScene {
 public:
  ShapeScene() {
    Random random(kSeed + 16);
    for (unsigned i = 0; i < 30; ++i) {
      const auto balls = two_balls(random), more = two_balls(random);
      for (const ShapePoint& ball : {balls[0], balls[1], more[0]}) {
        if (ball.radius > 0.0f)
          spheres_.push_back({{ball.position[0], ball.position[1], ball.position[2]}, ball.radius});
        if (ball.radius > 0.0f) points_.push_back(ball);
        axis_.push_back(ball);
      }
      segments_.insert(segments_.end(), {3 * i, 3 * i + 1});
    }
    for (const Sphere& sphere : spheres_) sphere_boxes_.push_back(SphereSet::bounds(sphere));
    for (const std::uint32_t s : segments_) curve_boxes_.push_back(RoundCurveSet::bounds(axis_[s], axis_[s + 1]));
    const build::Shapes of_spheres{ShapeKind::kSpheres, points_, {}}, of_curves{ShapeKind::kCurves, axis_, segments_};
    const build::CustomGeometry geometries[] = {{.boxes = sphere_boxes_, .shapes = of_spheres},
                                                {.boxes = curve_boxes_, .shapes = of_curves}};
    file_ = must(build::build(build::SceneInput{.customs = geometries}));
    const std::span<const std::byte> files[] = {file_.buffer.bytes()};
    const build::Instance instances[] = {{.object = 0, .to_scene = lattice_affine(random, 3)}};
    instanced_ = must(build::build_instances(files, instances));
  }

  SceneView view() const { return view_of(file_); }
  SceneView instanced() const { return view_of(instanced_); }
  std::array<ShapePoint, 2> any(Random& random) const {
    const std::uint32_t s = segments_[random.below(static_cast<std::uint32_t>(segments_.size()))];
    return {axis_[s], axis_[s + 1]};
  }

  /// The closest hit when every shape is tried.
  template <class Real> [[gnu::noinline]] BasicHit<Real> try_all(const BasicRay<Real>& ray) const {
    BasicHit<Real> best;
    const auto try_one = [&](const auto& set, std::uint32_t geometry, std::uint32_t primitive) {
      set.intersect(ray, std::max(ray.tmin, Real(0)), std::numeric_limits<Real>::max(), primitive,
                    [&](const BasicCustomHit<Real>& hit) {
                      if (best.found() && hit.t >= best.t) return true;
                      best.t = hit.t;
                      best.u = hit.u;
                      best.v = hit.v;
                      best.normal = hit.normal;
                      best.error = hit.error;
                      best.geometry = geometry;
                      best.primitive = primitive;
                      return true;
                    });
    };
    for (std::uint32_t i = 0; i < spheres_.size(); ++i) try_one(SphereSet{spheres_.data()}, 0, i);
    for (std::uint32_t i = 0; i < segments_.size(); ++i) try_one(RoundCurveSet{axis_.data(), segments_.data()}, 1, i);
    return best;
  }

 private:
  std::vector<Sphere> spheres_;
  std::vector<ShapePoint> points_, axis_;
  std::vector<std::uint32_t> segments_;
  std::vector<Box> sphere_boxes_, curve_boxes_;
  build::Bvh file_, instanced_;
};

/// Trees over shapes hide no hit. @param scene the shapes, or one instance of them.
template <class P> unsigned scene_of_shapes(const std::string& name, const ShapeScene& shapes, const SceneView& scene) {
  using Real = typename P::Real;
  constexpr unsigned kRays = 1000;
  Check check(name + ": no box hides a shape", kSeed + 17);
  Random random(kSeed + 17);
  const auto path = only_path<P::kLevels>(scene);
  for (unsigned i = 0; i < kRays; ++i) {
    Aim aim = aim_at_balls(shapes.any(random), random);
    aim.from = to_scene(scene, path, 0.0f, aim.from);
    aim.to = to_scene(scene, path, 0.0f, aim.to);
    const auto ray = convert<Real>(aim.ray());
    check.on_ray(ray);
    const auto expected = shapes.try_all(seen_from(scene, path, ray));
    typename P::Stack::Memory memory;
    ClosestHit<P, NoFilter, SceneShapes> query(scene, ray, typename P::Stack::Storage(memory), {}, SceneShapes(scene));
    const auto hit = query.next_hit();
    check.on_hit(hit);
    expect_same(check, expected, hit, P::kLevels == 0);
  }
  return check.finish(kRays / 3);
}

/// All of the above.
inline unsigned shapes() {
  const ShapeScene scene;
  unsigned faults = shapes_against_exact() + shapes_of_any_size() + boxes_of_shapes();
  faults += scene_of_shapes<Policies>("shapes", scene, scene.view());
  faults += scene_of_shapes<DoubleRays<>>("shapes, double", scene, scene.view());
  faults += scene_of_shapes<Instanced<Policies>>("shapes, instance", scene, scene.instanced());
  return faults;
}

}  // namespace hiprt::flags
