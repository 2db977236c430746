#pragma once
/// Transforms of points, directions, normals and rays between a scene and an object that it has an instance of.

#include <hiprt_device/math/affine.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace instance_detail {

/// A row times a vector. Every machine rounds it alike.
template <class Real> HIPRT_HD HIPRT_FORCE_INLINE Real times(const float (&row)[3], const BasicVec3<Real>& v) {
  const Real x = row[0], y = row[1], z = row[2];
  return fused_multiply_add(x, v.x, fused_multiply_add(y, v.y, z * v.z));
}

}  // namespace instance_detail

/// linear * v: a direction of the scene as the object sees it.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> vector_to_object(const InstanceRecord& instance, const BasicVec3<Real>& v) {
  using instance_detail::times;
  return {times(instance.linear[0], v), times(instance.linear[1], v), times(instance.linear[2], v)};
}

/// linear * (p - translation). The difference comes first: far from the origin it loses no more than p has lost
/// already.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> point_to_object(const InstanceRecord& instance, const BasicVec3<Real>& p) {
  const float(&origin)[3] = instance.translation;
  return vector_to_object(instance, BasicVec3<Real>(p.x - origin[0], p.y - origin[1], p.z - origin[2]));
}

/// The ray as the object sees it. t, tmin, tmax and mask stay the same; the direction's length changes.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE BasicRay<Real> ray_to_object(const InstanceRecord& instance, const BasicRay<Real>& ray) {
  BasicRay<Real> local = ray;
  local.origin = point_to_object(instance, ray.origin);
  local.direction = vector_to_object(instance, ray.direction);
  return local;
}

/// transpose(linear) * n: a normal of the object's surface as the scene sees it. Lengths change.
template <class Real>
HIPRT_HD HIPRT_FORCE_INLINE BasicVec3<Real> normal_to_scene(const InstanceRecord& instance, const BasicVec3<Real>& n) {
  const float(&m)[3][3] = instance.linear;
  const auto column = [&](unsigned c) { return instance_detail::times({m[0][c], m[1][c], m[2][c]}, n); };
  return {column(0), column(1), column(2)};
}

/// transpose(inverse(linear)) * n: the inverse of normal_to_scene().
HIPRT_HD inline Vec3 normal_to_object(const InstanceRecord& instance, const Vec3& n) {
  const LinearInverse inverse(instance);
  const auto column = [&](unsigned c) {
    return static_cast<float>(
        fused_multiply_add(inverse.row[0][c], static_cast<double>(n.x),
                           fused_multiply_add(inverse.row[1][c], static_cast<double>(n.y), inverse.row[2][c] * n.z)));
  };
  return Vec3(column(0), column(1), column(2));
}

/// inverse(linear) * v: a direction of the object as the scene sees it. In double, rounded once.
template <class Real>
HIPRT_HD inline BasicVec3<Real> vector_to_scene(const InstanceRecord& instance, const BasicVec3<Real>& v) {
  const LinearInverse inverse(instance);
  const auto component = [&](unsigned k) { return static_cast<Real>(inverse.times(k, v.x, v.y, v.z)); };
  return {component(0), component(1), component(2)};
}

/// inverse(linear) * p + translation. In double, rounded once.
template <class Real>
HIPRT_HD inline BasicVec3<Real> point_to_scene(const InstanceRecord& instance, const BasicVec3<Real>& p) {
  const LinearInverse inverse(instance);
  const auto component = [&](unsigned k) {
    return static_cast<Real>(inverse.times(k, p.x, p.y, p.z) + instance.translation[k]);
  };
  return {component(0), component(1), component(2)};
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
