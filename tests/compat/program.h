#pragma once
/// A program of HIPRT whose intersect and filter functions a test chooses: they are in its payload.

#include <hiprt/hiprt_device.h>

#include <hiprt_device/format/shape.h>

#include <functional>
#include <vector>

namespace hiprt::test {

/// What the dispatchers get, besides the hit and the payload.
struct Call {
  std::uint32_t geom_type, ray_type;
  const hiprtFuncTableHeader& header;
  const hiprtRay& ray;
};

/// The payload.
struct Program {
  std::function<bool(const Call&, hiprtHit&)> intersect = [](const Call&, hiprtHit&) { return false; };
  std::function<bool(const Call&, const hiprtHit&)> filter = [](const Call&, const hiprtHit&) { return false; };
};

/// A table with its data sets.
struct Table {
  std::vector<hiprtFuncDataSet> sets;
  hiprtFuncTableHeader header;

  Table(std::uint32_t geom_types, std::uint32_t ray_types)
      : sets(std::size_t{geom_types} * ray_types), header{geom_types, ray_types, sets.data()} {}
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  hiprtFuncTable handle() { return &header; }
};

inline hiprtRay make_ray(const hiprtFloat3& origin, const hiprtFloat3& direction, float min_t = 0.0f,
                         float max_t = hiprt::FltMax) {
  hiprtRay ray;
  ray.origin = origin;
  ray.direction = direction;
  ray.minT = min_t;
  ray.maxT = max_t;
  return ray;
}

/// All hits of a traversal. Its state must agree with them.
template <class Traversal> std::vector<hiprtHit> all_hits(Traversal&& traversal) {
  std::vector<hiprtHit> hits;
  for (;;) {
    const hiprtHit hit = traversal.getNextHit();
    if (!hit.hasHit()) return hits;
    hits.push_back(hit);
  }
}

/// The nearest crossing with a sphere between minT and maxT, as intersect functions of programs have it.
inline bool intersect_sphere(const hiprtRay& ray, const ShapePoint& sphere, hiprtHit& hit) {
  const hiprtFloat3 center{sphere.position[0], sphere.position[1], sphere.position[2]}, from = ray.origin - center;
  const float a = dot(ray.direction, ray.direction), b = dot(from, ray.direction),
              c = dot(from, from) - sphere.radius * sphere.radius, d = b * b - a * c;
  if (d < 0.0f) return false;
  const float root = std::sqrt(d);
  for (const float t : {(-b - root) / a, (-b + root) / a})
    if (t >= ray.minT && t <= ray.maxT) {
      hit.t = t;
      hit.uv = {0.25f, 0.75f};
      hit.normal = from + t * ray.direction;
      return true;
    }
  return false;
}

}  // namespace hiprt::test
