#pragma once
/// Where an object's vertices are in the scene, along a path of instances. For queries that measure in the scene.

#include <hiprt_device/instances/object_view.h>
#include <hiprt_device/math/affine.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// At least the square of the longest image of a unit vector. Exact for rotations and scales in either order.
///
/// It is the smaller of Gershgorin's bounds of the largest eigenvalue of linear * transpose(linear) and
/// transpose(linear)
/// * linear.
HIPRT_HD inline double stretch_squared(const InstanceRecord& instance) {
  using affine_detail::larger, affine_detail::smaller;
  const float(&m)[3][3] = instance.linear;
  const auto bound = [&](bool of_rows) {
    double largest = 0.0;
    for (unsigned i = 0; i < 3; ++i) {
      double sum = 0.0;
      for (unsigned k = 0; k < 3; ++k) {
        double dot = 0.0;
        for (unsigned j = 0; j < 3; ++j)
          dot = fused_multiply_add(static_cast<double>(of_rows ? m[i][j] : m[j][i]),
                                   static_cast<double>(of_rows ? m[k][j] : m[j][k]), dot);
        sum += LinearInverse::size(dot);
      }
      largest = larger(largest, sum);
    }
    return largest;
  };
  return smaller(bound(true), bound(false)) * (1.0 + 0x1p-45);
}

/// The transforms of the instances that a traversal is in.
/// @tparam kLevels the most instances.
template <unsigned kLevels> class PlacedVertices {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE void enter(const InstanceRecord& instance) {
    Level& level = level_[depth_++];
    const LinearInverse inverse(instance);
    for (unsigned k = 0; k < 3; ++k) {
      for (unsigned c = 0; c < 3; ++c) level.row[k][c] = inverse.row[k][c];
      level.translation[k] = instance.translation[k];
    }
  }
  HIPRT_HD HIPRT_FORCE_INLINE void leave() { --depth_; }
  /// Whether the object at hand is in an instance.
  HIPRT_HD HIPRT_FORCE_INLINE bool is_placed() const { return depth_ != 0; }

  /// A point of the object at hand, in the scene.
  HIPRT_HD HIPRT_FORCE_INLINE Vec3D to_scene(Vec3D point) const {
    for (unsigned i = depth_; i-- > 0;) {
      const Level& level = level_[i];
      const auto component = [&](unsigned k) HIPRT_FORCE_INLINE_LAMBDA {
        return fused_multiply_add(
            level.row[k][0], point.x,
            fused_multiply_add(level.row[k][1], point.y,
                               fused_multiply_add(level.row[k][2], point.z, level.translation[k])));
      };
      point = {component(0), component(1), component(2)};
    }
    return point;
  }

 private:
  struct Level {
    double row[3][3], translation[3];
  };
  Level level_[kLevels];
  unsigned depth_ = 0;
};
template <> class PlacedVertices<0> {
 public:
  HIPRT_HD HIPRT_FORCE_INLINE void enter(const InstanceRecord&) {}
  HIPRT_HD HIPRT_FORCE_INLINE void leave() {}
  HIPRT_HD HIPRT_FORCE_INLINE bool is_placed() const { return false; }
  HIPRT_HD HIPRT_FORCE_INLINE Vec3D to_scene(const Vec3D& point) const { return point; }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
