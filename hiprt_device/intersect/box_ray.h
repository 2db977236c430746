#pragma once
/// The form of double rays that tests boxes: a float ray that starts near the boxes.

#include <hiprt_device/intersect/box_test.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Whether the ray can hit anything; false for NaN and infinite components.
template <class Real> HIPRT_HD HIPRT_FORCE_INLINE bool is_traceable(const BasicRay<Real>& ray) {
  constexpr Real kMax = std::numeric_limits<Real>::max(), kZero = 0;
  const Real length = max_component(ray.direction);
#if HIPRT_SIMD_LANES
  if constexpr (std::is_same_v<Real, float>) {
    using Four = SimdLanes;
    // Zero times a number that is not finite is NaN.
    const auto sum =
        Four::add(Four::mul(Four::set(ray.origin.x, ray.origin.y, ray.origin.z, ray.tmin), Four::all(0.0f)),
                  Four::mul(Four::set(ray.direction.x, ray.direction.y, ray.direction.z, 0.0f), Four::all(0.0f)));
    return Four::less_equal(sum, Four::all(0.0f)) == 0xfu && length > kZero && length <= kMax && ray.tmin <= ray.tmax &&
           ray.tmax >= kZero && ray.mask != 0;
  }
#endif
  const Real sum = absolute(ray.direction.x) * kZero + absolute(ray.direction.y) * kZero +
                   absolute(ray.direction.z) * kZero + ray.origin.x * kZero + ray.origin.y * kZero +
                   ray.origin.z * kZero + ray.tmin * kZero;
  return sum == kZero && length > kZero && length <= kMax && ray.tmin <= ray.tmax && ray.tmax >= kZero && ray.mask != 0;
}

/// The ray that tests a tree's boxes, and the part of it that is left. A float ray is that ray itself.
template <class Real> class BoxRay {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE BoxRay(const Ray&, const Box&, float) {}
  HIPRT_HD static HIPRT_FORCE_INLINE const Ray& ray(const Ray& of_query) { return of_query; }
  HIPRT_HD static HIPRT_FORCE_INLINE float margin(float of_boxes, float, float) { return of_boxes; }
  HIPRT_HD static HIPRT_FORCE_INLINE float near_end(float tmin) { return tmin; }
  HIPRT_HD static HIPRT_FORCE_INLINE float far_end(float limit) { return limit; }
  HIPRT_HD static HIPRT_FORCE_INLINE void set_limit(float) {}
  HIPRT_HD static HIPRT_FORCE_INLINE float t_at(float distance) { return distance; }
};

/// A double ray from `start` on, rounded. Its direction is multiplied by a power of two, so that any length fits.
///
/// The two rays stay as close to each other as the margin allows (docs/proofs/double-rays.md). This holds within the
/// boxes' bounds, and between start and the point where the ray has left them. Distances are (t - start) * scale.
template <> class BoxRay<double> {
 public:
  /// @param bounds of the boxes.
  /// @param limit the largest t.
  HIPRT_HD HIPRT_FORCE_INLINE BoxRay(const RayD& ray, const Box& bounds, double limit) {
    const Vec3D center(middle(bounds, 0), middle(bounds, 1), middle(bounds, 2));
    const Vec3D to = center - ray.origin;
    const double extent = max_of(max_of(half(bounds, 0), half(bounds, 1)), half(bounds, 2));
    const double away = max_component(to) + extent;
    // Powers of two keep squares in range.
    const double unit = power_of_two_at_most(max_component(ray.direction));
    const Vec3D direction = ray.direction * (1.0 / unit);
    const double squared = dot(direction, direction), along = dot(to, direction);
    // A ball around the bounds, twice as large as necessary. |direction| is between 1 and 2 sqrt(3).
    const double radius = 4.0 * extent + 0x1p-44 * away;
    const double entry = (along / squared - radius) / unit;
    start_ = max_of(ray.tmin, 0.0);
    if (entry > start_ && entry <= std::numeric_limits<double>::max()) start_ = entry;
    scale_ = unit;
    const Vec3D from(fused_multiply_add(start_, ray.direction.x, ray.origin.x),
                     fused_multiply_add(start_, ray.direction.y, ray.origin.y),
                     fused_multiply_add(start_, ray.direction.z, ray.origin.z));
    ray_.origin = Vec3(rounded(from.x), rounded(from.y), rounded(from.z));
    ray_.direction = Vec3(rounded(direction.x), rounded(direction.y), rounded(direction.z));
    ray_.mask = ray.mask;
    ray_.time = ray.time;
    near_slack_ = rounded(0x1p-23 * max_component(from));
    far_slack_ = rounded(0x1p-45 * (away + max_component(ray.origin)));
    set_limit(limit);
  }

  HIPRT_HD HIPRT_FORCE_INLINE const Ray& ray(const RayD&) const { return ray_; }
  /// By how much boxes are widened.
  /// @param of_boxes the margin of the box test with ray().
  /// @param condition, transform_reach as those of BoxTest::margin(); 0 without instances.
  HIPRT_HD HIPRT_FORCE_INLINE float margin(float of_boxes, float condition, float transform_reach) const {
    return of_boxes + near_slack_ + (1.0f + condition) * (far_slack_ + 0x1p-45f * transform_reach);
  }
  /// A distance that is at most that of t.
  HIPRT_HD HIPRT_FORCE_INLINE float near_end(double t) const {
    return larger(rounded((t - start_) * scale_) * (1.0f - 0x1p-22f), 0.0f);
  }
  /// A distance that is at least that of the limit that was set last.
  HIPRT_HD HIPRT_FORCE_INLINE float far_end(double) const { return far_; }
  HIPRT_HD HIPRT_FORCE_INLINE void set_limit(double t) {
    far_ = larger(rounded((t - start_) * scale_) * (1.0f + 0x1p-22f), 0.0f);
  }

  /// t of a distance, for observers.
  HIPRT_HD HIPRT_FORCE_INLINE float t_at(float distance) const { return rounded(start_ + distance / scale_); }

 private:
  HIPRT_HD static HIPRT_FORCE_INLINE double middle(const Box& box, unsigned axis) {
    return 0.5 * (static_cast<double>(box.min[axis]) + static_cast<double>(box.max[axis]));
  }
  HIPRT_HD static HIPRT_FORCE_INLINE double half(const Box& box, unsigned axis) {
    return 0.5 * (static_cast<double>(box.max[axis]) - static_cast<double>(box.min[axis]));
  }
  HIPRT_HD static HIPRT_FORCE_INLINE double dot(const Vec3D& a, const Vec3D& b) {
    return fused_multiply_add(a.x, b.x, fused_multiply_add(a.y, b.y, a.z * b.z));
  }
  /// @param a positive and finite. A subnormal number counts as the smallest normal one.
  HIPRT_HD static HIPRT_FORCE_INLINE double power_of_two_at_most(double a) {
    const double power = std::bit_cast<double>(std::bit_cast<std::uint64_t>(a) & 0x7ff0000000000000u);
    return max_of(power, std::numeric_limits<double>::min());
  }
  /// The nearest finite float.
  HIPRT_HD static HIPRT_FORCE_INLINE float rounded(double a) {
    constexpr double kMax = std::numeric_limits<float>::max();
    return static_cast<float>(a < -kMax ? -kMax : a > kMax ? kMax : a);
  }

  Ray ray_;
  double start_, scale_;
  float near_slack_, far_slack_, far_ = 0.0f;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
