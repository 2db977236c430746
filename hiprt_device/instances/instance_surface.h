#pragma once
/// The normal and the error bound of a hit in an object, as the scene sees them.

#include <hiprt_device/instances/levels.h>
#include <hiprt_device/intersect/hit_surface.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace surface_detail {

/// An instance on the path of a hit, with bounds of the errors of its transform. The bounds have the same bits on
/// every machine.
/// @tparam Real of the ray.
template <bool kMoves, class Real> class EnteredInstance {
 public:
  /// @param motion nullptr: the instance stands still.
  /// @param ray outside the instance.
  HIPRT_HD void enter(const InstanceRecord& record, const MotionRecord* motion, const BasicRay<Real>& ray, Real t) {
    if constexpr (kMoves)
      record_ = record;
    else
      record_ = &record;
    const auto extent = [&](unsigned axis, Real origin, Real direction) {
      return absolute(origin - record.translation[axis]) + absolute(t * direction);
    };
    const BasicVec3<Real> from(extent(0, ray.origin.x, ray.direction.x), extent(1, ray.origin.y, ray.direction.y),
                               extent(2, ray.origin.z, ray.direction.z));
    Real most = 0;
    for (const float(&row)[3] : record.linear) {
      const Real x = absolute(row[0]), y = absolute(row[1]), z = absolute(row[2]);
      most = max_of(most, fused_multiply_add(x, from.x, fused_multiply_add(y, from.y, z * from.z)));
    }
    inside_ = to_bound(Real(10) * kUnit<Real> * most);
    // The transform of a moving instance is computed in float, whatever the precision of the ray.
    if constexpr (kMoves)
      if (motion != nullptr)
        outside_ = kUnit<float> * fused_multiply_add(14.0f * motion->rounding, to_bound(from.x + from.y + from.z),
                                                     6.0f * motion->farthest);
  }
  /// The instance at the ray's time.
  HIPRT_HD const InstanceRecord& record() const {
    if constexpr (kMoves)
      return record_;
    else
      return *record_;
  }
  /// Converts an error bound inside the instance to one outside, and adds the errors of the transform.
  HIPRT_HD float error_outside(float error) const {
    return fused_multiply_add(static_cast<float>(LinearInverse(record()).norm()), error + inside_, outside_);
  }

 private:
  // The record of a moving instance is computed; it is not in the file.
  std::conditional_t<kMoves, InstanceRecord, const InstanceRecord*> record_{};
  float inside_ = 0.0f;   ///< Error of the ray's transform, in units of the object.
  float outside_ = 0.0f;  ///< Error of the position of a moving instance, in units outside.
};

}  // namespace surface_detail

/// Sets a hit's normal and error bound as the scene sees them. The normal may have any length.
///
/// The error bound includes the errors of transforming the ray, and of transforming a ray that starts there
/// (docs/proofs/instances.md).
/// @param complete_in called with the ray as the object sees it and the first byte of the object's file. It sets both
/// as the object sees them.
/// @tparam kMoves whether instances may move.
template <bool kMoves, class Real, unsigned kLevels, class Complete>
HIPRT_HD inline void complete_along(const SceneView& scene, BasicPathHit<Real, kLevels>& hit, const BasicRay<Real>& ray,
                                    Complete&& complete_in) {
  using surface_detail::kUnit, surface_detail::to_bound;
  surface_detail::EnteredInstance<kMoves, Real> entered[kLevels];
  BasicRay<Real> local = ray;
  const auto enter = [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord* motion, unsigned i) {
    entered[i].enter(record, motion, local, hit.t);
    local = ray_to_object(record, local);
  };
  const ObjectView view = follow<kMoves>(scene, hit.path, ray.time, enter);
  complete_in(local, view.base);
  for_levels_backwards<kLevels>(hit.path.depth, [&](unsigned i) HIPRT_FORCE_INLINE_LAMBDA {
    const InstanceRecord& record = entered[i].record();
    const Real length = max_component(hit.normal);
    hit.normal = normal_to_scene(record, length > Real(0) ? divided(hit.normal, length) : hit.normal);
    hit.error = entered[i].error_outside(hit.error);
  });
  if (hit.path.depth != 0)
    hit.error = to_bound(
        fused_multiply_add(Real(4) * kUnit<Real>,
                           fused_multiply_add(absolute(hit.t), max_component(ray.direction), max_component(ray.origin)),
                           static_cast<Real>(hit.error)));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
