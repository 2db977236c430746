#pragma once
/// What a hit tells about the surface: normal and error bound, from the triangle's vertices.

#include <hiprt_device/format/layout.h>
#include <hiprt_device/instances/levels.h>
#include <hiprt_device/intersect/triangle_test.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace surface_detail {

/// a * d - b * c, to the last bit the same on every machine (Kahan).
HIPRT_HD HIPRT_INLINE double difference_of_products(double a, double d, double b, double c) {
  const double product = b * c;
  return fused_multiply_add(a, d, -product) + fused_multiply_add(-b, c, product);
}

/// cross(edge1, edge2), times a power of two where a float could not hold it.
template <class Real>
HIPRT_HD HIPRT_INLINE BasicVec3<Real> make_normal(const double (&edge1)[3], const double (&edge2)[3]) {
  const double x = difference_of_products(edge1[1], edge2[2], edge1[2], edge2[1]);
  const double y = difference_of_products(edge1[2], edge2[0], edge1[0], edge2[2]);
  const double z = difference_of_products(edge1[0], edge2[1], edge1[1], edge2[0]);
  const auto size = [](double a) { return a < 0.0 ? -a : a; };
  double largest = size(x) > size(y) ? size(x) : size(y);
  largest = size(z) > largest ? size(z) : largest;
  // The products of float differences are between 2^-298 and 2^258.
  const double scale = largest < 0x1p-200   ? 0x1p200
                       : largest < 0x1p-100 ? 0x1p100
                       : largest >= 0x1p127 ? 0x1p-132
                                            : 1.0;
  return {static_cast<Real>(x * scale), static_cast<Real>(y * scale), static_cast<Real>(z * scale)};
}

/// The rounding of a number, relatively.
template <class Real> inline constexpr Real kUnit = std::numeric_limits<Real>::epsilon() / 2;

/// A bound as hits have it. In double it is rounded up.
HIPRT_HD HIPRT_INLINE float to_bound(float bound) { return bound; }
HIPRT_HD HIPRT_INLINE float to_bound(double bound) {
  constexpr double kMax = std::numeric_limits<float>::max();
  const auto nearest = static_cast<float>((bound < kMax ? bound : kMax) * (1.0 - 0x1p-24));
  // Fused: the same bits everywhere.
  return fused_multiply_add(nearest, 1.0f + 0x1p-22f, 0x1p-149f);
}

/// An instance on the way to a hit, and what its transform may be off by. Bounds too are the same bits everywhere.
/// @tparam Real of the ray.
template <bool kMoves, class Real> class EnteredInstance {
 public:
  /// @param motion nullptr: it stands still. @param ray outside.
  HIPRT_HD void enter(const InstanceRecord& record, const MotionRecord* motion, const BasicRay<Real>& ray, Real t) {
    if constexpr (kMoves)
      record_ = record;
    else
      record_ = &record;
    const auto way = [&](unsigned axis, Real origin, Real direction) {
      return absolute(origin - record.translation[axis]) + absolute(t * direction);
    };
    const BasicVec3<Real> from(way(0, ray.origin.x, ray.direction.x), way(1, ray.origin.y, ray.direction.y),
                               way(2, ray.origin.z, ray.direction.z));
    Real most = 0;
    for (const float(&row)[3] : record.linear) {
      const Real x = absolute(row[0]), y = absolute(row[1]), z = absolute(row[2]);
      most = max_of(most, fused_multiply_add(x, from.x, fused_multiply_add(y, from.y, z * from.z)));
    }
    inside_ = to_bound(Real(10) * kUnit<Real> * most);
    // What moves is placed in float, whatever the ray is.
    if constexpr (kMoves)
      if (motion != nullptr)
        outside_ = kUnit<float> * fused_multiply_add(14.0f * motion->rounding, to_bound(from.x + from.y + from.z),
                                                     6.0f * motion->farthest);
  }
  /// As it is at the ray's time.
  HIPRT_HD const InstanceRecord& record() const {
    if constexpr (kMoves)
      return record_;
    else
      return *record_;
  }
  /// A bound of an error inside, with those of the transform.
  HIPRT_HD float error_outside(float error) const {
    return fused_multiply_add(static_cast<float>(LinearInverse(record()).norm()), error + inside_, outside_);
  }

 private:
  // What moves is nowhere in the file.
  std::conditional_t<kMoves, InstanceRecord, const InstanceRecord*> record_{};
  float inside_ = 0.0f;   ///< Of the ray's transform, in the object.
  float outside_ = 0.0f;  ///< Of the place of what moves, outside.
};

}  // namespace surface_detail

/// Normal and error bound from the leaf's vertices.
template <class Layout, class Real>
HIPRT_HD inline void complete(BasicHit<Real>& hit, const BasicRay<Real>& ray, const typename Layout::Leaf& leaf,
                              unsigned triangle) {
  unsigned vertex[3] = {corner_vertex(triangle, 0), corner_vertex(triangle, 1), corner_vertex(triangle, 2)};
  to_mesh_order(vertex, leaf.info.triangle_ids >> (8 * triangle));
  double edge1[3], edge2[3];
  Real reach = 0, extent = 0, magnitude = 0;
  const auto read = [&](unsigned axis, Real o) {
    const Real a = Layout::coordinate(leaf, vertex[0], axis), b = Layout::coordinate(leaf, vertex[1], axis),
               c = Layout::coordinate(leaf, vertex[2], axis);
    edge1[axis] = static_cast<double>(b) - static_cast<double>(a);
    edge2[axis] = static_cast<double>(c) - static_cast<double>(a);
    reach = max_of(reach, max_of(max_of(absolute(a - o), absolute(b - o)), absolute(c - o)));
    extent = max_of(extent, max_of(max_of(absolute(b - a), absolute(c - a)), absolute(c - b)));
    magnitude = max_of(magnitude, max_of(max_of(absolute(a), absolute(b)), absolute(c)));
  };
  read(0, ray.origin.x);
  read(1, ray.origin.y);
  read(2, ray.origin.z);
  hit.normal = surface_detail::make_normal<Real>(edge1, edge2);
  using surface_detail::kUnit;
  hit.error = surface_detail::to_bound(kUnit<Real> * fused_multiply_add(Real(20), reach + extent, Real(4) * magnitude));
}

/// The hit of an object's surface as the scene sees it: its normal, in any length, and its error bound, with what the
/// transforms of the ray, and of one that starts there, may add (docs/decisions/0014-instances.md).
/// @param complete_in called with the ray as the object sees it, and the first byte of the object's file: sets both as
/// the object sees them.
/// @tparam kMoves whether instances may move.
template <bool kMoves, class Real, unsigned kLevels, class Complete>
HIPRT_HD inline void complete_along(const SceneView& scene, BasicPathHit<Real, kLevels>& hit, const BasicRay<Real>& ray,
                                    Complete&& complete_in) {
  using surface_detail::kUnit, surface_detail::to_bound;
  surface_detail::EnteredInstance<kMoves, Real> entered[kLevels];
  BasicRay<Real> local = ray;
  unsigned depth = 0;
  const auto enter = [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord* motion) {
    entered[depth++].enter(record, motion, local, hit.t);
    local = ray_to_object(record, local);
  };
  const ObjectPlace place = follow<kMoves>(scene, hit.path, ray.time, enter);
  complete_in(local, place.base);
  while (depth-- > 0) {
    const InstanceRecord& record = entered[depth].record();
    const Real length = max_component(hit.normal);
    hit.normal = normal_to_scene(record, length > Real(0) ? divided(hit.normal, length) : hit.normal);
    hit.error = entered[depth].error_outside(hit.error);
  }
  if (hit.path.depth != 0)
    hit.error = to_bound(
        fused_multiply_add(Real(4) * kUnit<Real>,
                           fused_multiply_add(absolute(hit.t), max_component(ray.direction), max_component(ray.origin)),
                           static_cast<Real>(hit.error)));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
