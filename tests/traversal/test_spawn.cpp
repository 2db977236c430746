// Rays spawned at hits do not hit the surface that they leave, and their origins move no farther than necessary.

#include <hiprt_device/query/spawn.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/aim.h>
#include <tests/traversal/explain.h>
#include <tests/traversal/scenes.h>
#include <tests/traversal/tracers.h>
#include <tests/traversal/workers.h>

#include <tests/catch.h>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 404;
/// The distance moved is at most this many times the hit's error bound: sqrt(3) for a normal along a diagonal, plus 1.
/// The 1 is the rounding of the sum, which the bound includes.
constexpr double kMaxMove = 2.74;
/// The same for triangles without area, whose hits are moved twice as far.
constexpr double kMaxMoveAlong = 2 * kMaxMove;
/// The error bound is at most this many units of 2^-24 times the largest coordinate or distance involved.
constexpr double kMaxError = 65.0;

struct Findings {
  std::uint64_t hits = 0, same_triangle = 0;
  double move = 0;        ///< Largest distance between spawned origin and hit point, in hit.error.
  double move_along = 0;  ///< The same of hits without a normal.
  double bound = 0;       ///< Largest hit.error in 2^-24 * the largest of reach and coordinates.
  double needed = 0;      ///< Largest true distance of a hit point from its triangle's plane, in hit.error.
  std::string first;
};

/// The hit point as spawn_origin() computes it, up to contraction.
Double3 hit_point(const Ray& ray, const Hit& hit) {
  const Double3 o = oracle::detail::to_double(position(ray.origin)),
                d = oracle::detail::to_double(position(ray.direction));
  return along(o, hit.t, d);
}

double largest_number(const Ray& ray, const Corners& c) {
  double largest = 0;
  for (const Position& p : {c.p0, c.p1, c.p2, position(ray.origin)})
    for (const float x : p) largest = std::max(largest, std::abs(double{x}));
  for (const Position& p : {c.p0, c.p1, c.p2})
    for (std::size_t k = 0; k < 3; ++k)
      largest = std::max(largest, std::abs(double{p[k]} - ray.origin[static_cast<int>(k)]));
  return largest;
}

/// Leaves the surface at a hit in a random direction, and looks whether the ray meets the same triangle again.
void spawn(const Scene& scene, const Mesh& mesh, const Ray& ray, const Hit& hit, Random& random, Findings& findings) {
  const Double3 away = random.on_sphere();
  const double length = random.coin() ? 1.0 : random.log_uniform(1e-3, 1e3);
  Ray next;
  next.direction = Vec3(static_cast<float>(away[0] * length), static_cast<float>(away[1] * length),
                        static_cast<float>(away[2] * length));
  next.origin = spawn_origin(ray, hit, next.direction);
  ++findings.hits;
  const Corners c = corners(mesh, hit.primitive);
  const Double3 point = hit_point(ray, hit), origin = oracle::detail::to_double(position(next.origin));
  const Double3 n = oracle::detail::to_double(position(hit.normal));
  const double move = checks::length(origin - point) / hit.error;
  const bool has_normal = hit.normal.x != 0 || hit.normal.y != 0 || hit.normal.z != 0;
  (has_normal ? findings.move : findings.move_along) = std::max(has_normal ? findings.move : findings.move_along, move);
  findings.bound = std::max(findings.bound, hit.error / (kEpsilon * largest_number(ray, c)));
  const Double3 from = oracle::detail::to_double(c.p0) - point;
  const double sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
  if (has_normal) findings.needed = std::max(findings.needed, std::abs(checks::dot(from, n)) / sum / hit.error);
  for (const Tracer& tracer : default_tracers()) {
    const Hit again = tracer.closest(scene, next);
    if (!again.found() || again.primitive != hit.primitive) continue;
    if (findings.same_triangle++ == 0)
      findings.first = describe(ray) + "\n" + describe(hit) + "\n" + describe(c) + "\nspawned: " + describe(next) +
                       "\n" + describe(again);
  }
}

Findings spawn_many(const Closed& closed, const Scene& scene, unsigned rays) {
  constexpr unsigned kBlock = 500;
  const auto work = [&](std::size_t block, Findings& findings) {
    Random random(kSeed + block);
    for (unsigned i = 0; i < kBlock; ++i) {
      Ray ray = aimed_ray(closed, random, 1e3);
      if (random.coin())  // From outside, and at all angles.
        for (std::size_t k = 0; k < 3; ++k)
          ray.origin[static_cast<int>(k)] =
              static_cast<float>(closed.centers[0][k] + random.uniform(-2, 2) * closed.scale);
      const Hit hit = default_tracer().closest(scene, ray);
      if (hit.found()) spawn(scene, closed.mesh, ray, hit, random, findings);
    }
  };
  Findings sum;
  for (const Findings& part : for_each_parallel<Findings>(rays / kBlock + 1, work)) {
    sum.hits += part.hits, sum.same_triangle += part.same_triangle;
    sum.move = std::max(sum.move, part.move);
    sum.move_along = std::max(sum.move_along, part.move_along);
    sum.bound = std::max(sum.bound, part.bound);
    sum.needed = std::max(sum.needed, part.needed);
    if (sum.first.empty()) sum.first = part.first;
  }
  return sum;
}

}  // namespace

TEST_CASE("spawned rays do not hit the triangle that they leave", "[spawn]") {
  INFO("seed " << kSeed);
  std::uint64_t total = 0;
  std::printf("%-12s %10s %12s %8s %8s %8s\n", "mesh", "scale", "offset", "move", "bound", "needed");
  for (const Closed& unit : closed_meshes())
    for (const double scale : {1e-26, 1e-20, 1e-8, 1.0, 1e8, 1e14})
      for (const double offset : {0.0, 10.0, 1e3}) {
        // Fewer at scales where edge functions underflow: processors are slow then.
        const Closed closed = checks::placed(unit, scale, {offset * scale, -offset * scale, 0.5 * offset * scale});
        const Scene scene = make_scene({closed.mesh});
        const Findings f = spawn_many(closed, scene, trials(scale < 1e-15 ? 3000 : 18000));
        total += f.hits;
        std::printf("%-12s %10g %12g %8.3f %8.2f %8.4f\n", closed.name.c_str(), scale, offset * scale, f.move, f.bound,
                    f.needed);
        INFO(closed.name << " scale " << scale << " offset " << offset * scale << "\n" << f.first);
        CHECK(f.same_triangle == 0);
        CHECK(f.move <= kMaxMove);
        CHECK(f.move_along <= kMaxMoveAlong);
        CHECK(f.bound <= kMaxError);
        CHECK(f.needed <= 1);  // The bound that Hit::error states.
      }
  std::printf("spawn: %lu rays\n", total);
}
