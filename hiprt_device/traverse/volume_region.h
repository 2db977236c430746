#pragma once
/// A convex volume as a region: the boxes that are not certainly apart from it.

#include <hiprt_device/instances/placed_vertices.h>
#include <hiprt_device/intersect/box_distance.h>
#include <hiprt_device/intersect/volumes.h>
#include <hiprt_device/traverse/point_region.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Compares boxes with the volume's own box, and with the volume's shadows along the normals of its faces.
///
/// Any direction proves that two bodies are apart. So normals may be rounded, and only shadows need care.
/// @tparam kLevels the most instances that it is in.
template <class Lanes, unsigned kLevels> class VolumeRegion {
 public:
  /// @param volume in the scene; it must live as long as the region.
  HIPRT_HD VolumeRegion(const SceneView& scene, const ConvexVolume& volume) : volume_(&volume) {
    for (unsigned k = 0; k < volume.normals; ++k) {
      const double largest = max_component(volume.normal[k]);
      normal_[k] = largest > 0.0 ? Vec3(divided(volume.normal[k], largest)) : Vec3(0);
    }
    place(scene.bounds);
  }

  template <class Node> HIPRT_HD HIPRT_FORCE_INLINE BoxHits<Lanes> boxes(const Node& node) const {
    using Float = typename Lanes::Float;
    const PlanesOf<Lanes, Node> planes(node);
    const Float low[3] = {planes(node, 0, 0), planes(node, 1, 0), planes(node, 2, 0)},
                high[3] = {planes(node, 0, 1), planes(node, 1, 1), planes(node, 2, 1)};
    const Float zero = Lanes::all(0.0f);
    Float gap = zero;
    // Of a NaN and a number max() takes its second. Infinite planes of layout half may give a NaN.
    const auto widen = [&](const Float& other) HIPRT_FORCE_INLINE_LAMBDA { gap = Lanes::max(other, gap); };
    for (unsigned axis = 0; axis < 3; ++axis) {
      widen(Lanes::sub(low[axis], Lanes::all(box_.max[axis])));
      widen(Lanes::sub(Lanes::all(box_.min[axis]), high[axis]));
    }
    for (unsigned k = 0; k < halves_; ++k) {
      const auto term = [&](unsigned axis) HIPRT_FORCE_INLINE_LAMBDA {
        const float along = half_[k].normal[axis];
        return along > 0.0f ? Lanes::mul(low[axis], Lanes::all(along)) : Lanes::mul(high[axis], Lanes::all(along));
      };
      widen(Lanes::sub(Lanes::add(Lanes::add(term(0), term(1)), term(2)), Lanes::all(half_[k].farthest)));
    }
    return {gap, zero, existing<Lanes>(node, low[0], high[0])};
  }
  HIPRT_HD HIPRT_FORCE_INLINE float far_end() const { return 0.0f; }
  template <class Leaf> HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t outside(const Leaf&) const { return 0; }
  /// How far vertices may be from where they are, per axis, in the scene.
  HIPRT_HD HIPRT_FORCE_INLINE double vertex_error() const { return here_.vertex_error; }

  HIPRT_HD void enter(const InstanceRecord& instance, const ObjectRecord& object) {
    if constexpr (kLevels != 0) {
      outside_[depth_++] = {here_, instance, bounds_};
      here_ = here_.into(instance, object.bounds);
      place(object.bounds);
    }
  }
  HIPRT_HD void leave() {
    if constexpr (kLevels != 0) {
      const Outside& outside = outside_[--depth_];
      here_ = outside.here;
      place(outside.bounds);
    }
  }

 private:
  struct Half {
    float normal[3];
    float farthest;  ///< No point of the volume is farther along the normal.
  };
  struct Outside {
    region_detail::PlacedPoint here;
    InstanceRecord instance;
    Box bounds;
  };

  HIPRT_HD Vec3D corner(unsigned k) const {
    Vec3D at = volume_->origin + volume_->corner[k];
    if constexpr (kLevels != 0)
      for (unsigned i = 0; i < depth_; ++i) at = point_to_object(outside_[i].instance, at);
    return at;
  }
  HIPRT_HD Vec3 normal(unsigned k) const {
    Vec3 n = normal_[k];
    if constexpr (kLevels != 0)
      for (unsigned i = 0; i < depth_; ++i) {
        n = normal_to_object(outside_[i].instance, n);
        const float largest = max_component(n);
        n = largest > 0.0f ? divided(n, largest) : Vec3(0);
      }
    return n;
  }

  /// Prepares the tests for the boxes of a file. @param bounds of the file.
  HIPRT_HD void place(const Box& bounds) {
    bounds_ = bounds;
    Vec3D low(std::numeric_limits<double>::infinity()), high = -low;
    double far = 0.0;
    for (unsigned k = 0; k < volume_->corners; ++k) {
      const Vec3D at = corner(k);
      low = {at.x < low.x ? at.x : low.x, at.y < low.y ? at.y : low.y, at.z < low.z ? at.z : low.z};
      high = {max_of(at.x, high.x), max_of(at.y, high.y), max_of(at.z, high.z)};
      far = max_of(far, max_component(at));
    }
    here_.at = Vec3D(far);  // The largest magnitude, for the errors of transforms.
    const double magnitude = far + region_detail::magnitude(bounds);
    const double moved =
        fused_multiply_add(2.0 * square_root(here_.stretch_squared), here_.vertex_error, 2.0 * here_.error);
    const double margin = fused_multiply_add(region_detail::kDistanceRounding, magnitude, moved);
    const auto set = [&](unsigned axis, double from, double to) {
      box_.min[axis] = affine_detail::round_down(from - margin);
      box_.max[axis] = affine_detail::round_up(to + margin);
    };
    set(0, low.x, high.x);
    set(1, low.y, high.y);
    set(2, low.z, high.z);
    halves_ = volume_->is_aligned && depth_ == 0 ? 0 : 2 * volume_->normals;
    // Products and sums of a box's corner round by less than 2^-21 of its magnitude.
    for (unsigned k = 0; k < halves_; ++k)
      half_[k] = make_half((k & 1u) != 0 ? -normal(k >> 1) : normal(k >> 1), margin + 0x1p-21 * magnitude);
  }
  HIPRT_HD Half make_half(const Vec3& along, double margin) const {
    double farthest = -std::numeric_limits<double>::infinity();
    const Vec3D axis(along);
    for (unsigned k = 0; k < volume_->corners; ++k) farthest = max_of(point_detail::dot(axis, corner(k)), farthest);
    const double rounded = fused_multiply_add(point_detail::size(axis), margin, farthest);
    return {{along.x, along.y, along.z}, affine_detail::round_up(rounded)};
  }

  const ConvexVolume* volume_;
  region_detail::PlacedPoint here_{.at = Vec3D(0)};
  Vec3 normal_[6];  ///< In the scene; the largest component is 1.
  Box box_, bounds_;
  Half half_[12];
  unsigned halves_ = 0, depth_ = 0;
  Outside outside_[kLevels == 0 ? 1 : kLevels];
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
