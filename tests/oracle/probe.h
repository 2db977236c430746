#pragma once
/// Test rays with known results, made from a number alone: the same rays on every host and GPU. Meshes are closed and
/// lie around Target::centre, so that every ray from inside has a hit.

#include <hiprt_build/input.h>
#include <hiprt_device/query/closest_hit.h>
#include <hiprt_device/query/spawn.h>

#include <cstdint>

namespace hiprt::oracle {

enum class CheckKind : unsigned {
  kRandom,   ///< From inside in any direction; fault: a miss.
  kEdge,     ///< From inside at a point of an edge; fault: a miss.
  kVertex,   ///< From inside at a vertex; fault: a miss.
  kBoxes,    ///< From outside and inside at points of triangles; every third ray along an axis. Fault: not the hit that
             ///< the same triangle test finds when no box rejects a ray.
  kSpawned,  ///< A ray that starts where a ray from inside hit the mesh, back to the side of that ray.
             ///< Fault: it hits the triangle that it left; lost: it hits nothing.
  kCrossingsEdge,    ///< From outside at a point of an edge; fault: an odd number of crossings.
  kCrossingsVertex,  ///< From outside at a vertex; fault: an odd number of crossings.
  kTrace,            ///< No known result: traces rays[number] to hits[number].
};

/// What rays are aimed at. Pointers are the tracer's: to the device's memory on a GPU.
struct Target {
  SceneView scene;
  const build::Position* positions = nullptr;
  const build::Triangle* triangles = nullptr;
  std::uint32_t triangle_count = 0;
  Vec3 centre{0.0f};
  float inner_radius = 0.0f;  ///< A ball of this radius around the centre is inside.
  float extent = 0.0f;        ///< A cube of half this edge around the centre holds the mesh.
  const Ray* rays = nullptr;
  Hit* hits = nullptr;
};

struct Probe {
  CheckKind kind = CheckKind::kRandom;
  /// CheckKind::kSpawned: below 0 rays start at spawn_origin(); else at the hit point with this tmin, times the mesh's
  /// extent.
  float tmin = -1.0f;
  float time = 0.0f;  ///< Of the rays.
  Target target;
};

/// Of one ray, or of many.
struct Tally {
  std::uint64_t skipped = 0;  ///< Rays without a known result.
  std::uint64_t faults = 0;
  std::uint64_t lost = 0;
  /// Spawned rays that meet nothing because the mesh folds within the error bound of where they start: their origins
  /// may be beyond the fold (spawn.h). Not counted as lost.
  std::uint64_t folded = 0;
};

// Functions are compiled for several instruction sets: policies and what they call have names of their own for each.
inline namespace HIPRT_ISA_NAMESPACE {

/// Lets every ray into every box: the margin is beyond all scenes.
struct EveryBox {
  HIPRT_HD static HIPRT_FORCE_INLINE float margin(const Vec3&, const Box&) { return 0x1p100f; }
  HIPRT_HD static HIPRT_FORCE_INLINE float margin(const Vec3&, const Box&, float, float) { return 0x1p100f; }
};

namespace probe_detail {

/// Numbers of one ray (SplitMix64).
class Numbers {
 public:
  HIPRT_HD explicit Numbers(std::uint64_t ray) : state_(ray * 0x632be59bd9b4e019u + 20261123u) {}
  HIPRT_HD std::uint32_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return static_cast<std::uint32_t>((z ^ z >> 31) >> 32);
  }
  /// In [0, 1).
  HIPRT_HD float unit() { return static_cast<float>(next() >> 8) * 0x1p-24f; }
  /// In [-1, 1).
  HIPRT_HD float both() { return 2.0f * unit() - 1.0f; }
  /// A direction; not all alike, and never 0.
  HIPRT_HD Vec3 direction() {
    const float x = both(), y = both(), z = both();
    return Vec3(x, y, z == 0.0f ? 1.0f : z);
  }

 private:
  std::uint64_t state_;
};

HIPRT_HD inline Vec3 vec(const build::Position& p) { return Vec3(p[0], p[1], p[2]); }

/// A point inside the mesh.
HIPRT_HD inline Vec3 inside(const Target& target, Numbers& random) {
  const float reach = 0.5f * target.inner_radius;
  const float x = random.both(), y = random.both(), z = random.both();
  return target.centre + reach * Vec3(x, y, z);
}

/// a + s * (b - a) per component, the same bits whatever a compiler contracts.
HIPRT_HD inline Vec3 between(const Vec3& a, const Vec3& b, float s) {
  return Vec3(fused_multiply_add(s, b.x - a.x, a.x), fused_multiply_add(s, b.y - a.y, a.y),
              fused_multiply_add(s, b.z - a.z, a.z));
}

HIPRT_HD inline Ray ray_to(const Vec3& from, const Vec3& to) {
  Ray ray;
  ray.origin = from;
  ray.direction = to - from;
  return ray;
}

/// A point on the faces of a cube that is eight times as large as the mesh.
HIPRT_HD inline Vec3 outside(const Target& target, Numbers& random) {
  Vec3 offset = 8.0f * target.extent * random.direction();
  const unsigned face = random.next() % 3;
  const float far = random.next() % 2 == 0 ? 8.0f * target.extent : -8.0f * target.extent;
  if (face == 0) offset.x = far;
  if (face == 1) offset.y = far;
  if (face == 2) offset.z = far;
  return target.centre + offset;
}

HIPRT_HD inline bool is_crossings(CheckKind kind) {
  return kind == CheckKind::kCrossingsEdge || kind == CheckKind::kCrossingsVertex;
}

HIPRT_HD inline Ray aimed_ray(const Probe& probe, Numbers& random) {
  const Target& target = probe.target;
  const Vec3 from = is_crossings(probe.kind) ? outside(target, random) : inside(target, random);
  if (probe.kind == CheckKind::kRandom || probe.kind == CheckKind::kSpawned) {
    Ray ray;
    ray.origin = from;
    ray.direction = random.direction();
    return ray;
  }
  const build::Triangle triangle = target.triangles[random.next() % target.triangle_count];
  const unsigned first = random.next() % 3;
  const Vec3 a = vec(target.positions[triangle[first]]),
             b = vec(target.positions[triangle[first == 2 ? 0 : first + 1]]);
  const bool at_vertex = probe.kind == CheckKind::kVertex || probe.kind == CheckKind::kCrossingsVertex;
  return ray_to(from, between(a, b, at_vertex ? 0.0f : random.unit()));
}

HIPRT_HD inline Ray box_ray(const Target& target, std::uint64_t number, Numbers& random) {
  const build::Triangle triangle = target.triangles[random.next() % target.triangle_count];
  const Vec3 a = vec(target.positions[triangle[0]]), b = vec(target.positions[triangle[1]]),
             c = vec(target.positions[triangle[2]]);
  const Vec3 at = between(a, between(b, c, random.unit()), random.unit());
  const float x = random.both(), y = random.both(), z = random.both();
  const Vec3 from = target.centre + target.extent * Vec3(x, y, z);
  if (number % 3 != 0) return ray_to(from, at);
  // Along an axis, through the point in the other two, so that it may lie in the planes of boxes.
  const unsigned axis = random.next() % 3;
  Ray ray;
  ray.origin = at;
  ray.direction = Vec3(0.0f);
  const float far = random.next() % 2 == 0 ? target.extent : -target.extent;
  if (axis == 0) ray.origin.x = target.centre.x + far, ray.direction.x = -far;
  if (axis == 1) ray.origin.y = target.centre.y + far, ray.direction.y = -far;
  if (axis == 2) ray.origin.z = target.centre.z + far, ray.direction.z = -far;
  return ray;
}

/// The ray that leaves from where @p ray met something.
HIPRT_HD inline Ray spawned_ray(const Probe& probe, const Ray& ray, const Hit& hit, Numbers& random) {
  Ray next;
  // By the numbers that spawn_origin() goes by; a direction in the plane points to no side.
  const float length = max_component(hit.normal);
  const Vec3 n = length > 0.0f ? divided(hit.normal, length) : Vec3(1.0f, 0.0f, 0.0f);
  float side = 0.0f;
  while (side == 0.0f) {
    next.direction = random.direction();
    side = spawn_detail::dot(n, next.direction);
  }
  if ((side > 0.0f) == (spawn_detail::dot(n, ray.direction) >= 0.0f)) next.direction = -next.direction;
  if (probe.tmin < 0.0f) {
    next.origin = spawn_origin(ray, hit, next.direction);
  } else {
    next.origin = spawn_detail::moved(ray.origin, hit.t, ray.direction);
    next.tmin = probe.tmin * probe.target.extent;
  }
  return next;
}

/// Whether another triangle comes as near to the hit point as a spawned origin may be from it. Along an axis that is
/// the hit's error plus 1.37 errors by which spawn_origin() moves along the normal; 2.5 errors with rounding.
HIPRT_HD inline bool is_folded(const Target& target, const Ray& ray, const Hit& hit) {
  const Vec3 point = spawn_detail::moved(ray.origin, hit.t, ray.direction);
  const float reach = 2.5f * hit.error;
  for (std::uint32_t i = 0; i < target.triangle_count; ++i) {
    if (i == hit.primitive) continue;
    const build::Triangle triangle = target.triangles[i];
    const Vec3 a = vec(target.positions[triangle[0]]) - point, b = vec(target.positions[triangle[1]]) - point,
               c = vec(target.positions[triangle[2]]) - point;
    bool apart = false;
    for (int k = 0; k < 3; ++k)
      apart |= smaller(smaller(a[k], b[k]), c[k]) > reach || larger(larger(a[k], b[k]), c[k]) < -reach;
    const Vec3 p = b - a, q = c - a;
    const Vec3 n(p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x);
    const float height = absolute(n.x * a.x + n.y * a.y + n.z * a.z);
    if (!apart && height <= reach * (absolute(n.x) + absolute(n.y) + absolute(n.z))) return true;
  }
  return false;
}

HIPRT_HD inline Ray first_ray(const Probe& probe, std::uint64_t number, Numbers& random) {
  Ray ray = probe.kind == CheckKind::kBoxes ? box_ray(probe.target, number, random) : aimed_ray(probe, random);
  ray.time = probe.time;
  return ray;
}

}  // namespace probe_detail

/// The test ray @p number, for tracers that take many rays at once. Any kind but kTrace; for kSpawned the ray whose hit
/// the spawned ray leaves.
HIPRT_HD inline Ray test_ray(const Probe& probe, std::uint64_t number) {
  probe_detail::Numbers random(number);
  return probe_detail::first_ray(probe, number, random);
}

/// Traces the test ray @p number and checks its result. Any kind but kTrace. @param trace has closest(ray); for
/// CheckKind::kBoxes every_box(ray), the same with EveryBox; for crossings all(ray), the number of hits.
template <class Tracer> HIPRT_HD inline Tally check_ray(const Probe& probe, std::uint64_t number, const Tracer& trace) {
  using namespace probe_detail;
  Numbers random(number);
  Ray ray = first_ray(probe, number, random);
  if constexpr (requires { trace.all(ray); })
    if (is_crossings(probe.kind)) return {0, trace.all(ray) % 2, 0, 0};
  Hit left;
  Ray first;
  // Only one call of trace.closest(): kernels are twice as large with two.
  for (;;) {
    const Hit hit = trace.closest(ray);
    if constexpr (requires { trace.every_box(ray); })
      if (probe.kind == CheckKind::kBoxes) {
        const Hit truth = trace.every_box(ray);
        const bool same = hit.found() && hit.t == truth.t;
        return {truth.found() ? 0u : 1u, truth.found() && !same ? 1u : 0u, 0, 0};
      }
    if (probe.kind != CheckKind::kSpawned) return {0, hit.found() ? 0u : 1u, 0, 0};
    if (left.found()) {
      const bool folded = !hit.found() && probe.tmin < 0.0f && is_folded(probe.target, first, left);
      return {0, hit.primitive == left.primitive ? 1u : 0u, hit.found() || folded ? 0u : 1u, folded ? 1u : 0u};
    }
    if (!hit.found()) return {1, 0, 0, 0};
    left = hit;
    first = ray;
    ray = spawned_ray(probe, ray, hit, random);
    ray.time = probe.time;
  }
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::oracle
