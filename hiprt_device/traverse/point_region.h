#pragma once
/// The ball around a point that shrinks as nearer triangles are found.

#include <hiprt_device/instances/placed_vertices.h>
#include <hiprt_device/intersect/box_distance.h>
#include <hiprt_device/intersect/triangle_filter.h>
#include <hiprt_device/primitives/custom_point.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace region_detail {

/// How far a box reaches from a point along any axis, at most.
HIPRT_HD HIPRT_FORCE_INLINE double reach(const Box& box, const Vec3D& point) {
  const auto far = [&](unsigned axis, double x) HIPRT_FORCE_INLINE_LAMBDA {
    return max_of(absolute(box.max[axis] - x), absolute(x - box.min[axis]));
  };
  return max_of(max_of(far(0, point.x), far(1, point.y)), far(2, point.z));
}
HIPRT_HD HIPRT_FORCE_INLINE double magnitude(const Box& box) {
  const auto of = [&](unsigned axis) HIPRT_FORCE_INLINE_LAMBDA {
    return max_of(absolute(static_cast<double>(box.max[axis])), absolute(static_cast<double>(box.min[axis])));
  };
  return of(0) + of(1) + of(2);
}

/// The share of the reach that covers the rounding of distances, and of boxes of parts of triangles.
inline constexpr double kDistanceRounding = 0x1p-42;

/// Where a point is in an object, and how much rounding has moved it and the object's vertices.
struct PlacedPoint {
  Vec3D at;
  double error = 0.0;            ///< Of at, per axis.
  double stretch_squared = 1.0;  ///< A distance of 1 in the scene is at most the root of this one here.
  double growth = 1.0;           ///< A component of 1 here is at most so much in the scene.
  double vertex_error = 0.0;     ///< Of vertices, per axis, in the scene.

  HIPRT_HD HIPRT_FORCE_INLINE double margin(const Box& bounds) const {
    const double moved = fused_multiply_add(2.0 * square_root(stretch_squared), vertex_error, 2.0 * error);
    return fused_multiply_add(kDistanceRounding, reach(bounds, at), moved);
  }

  /// The same in an object. docs/proofs/closest-points.md: Instances.
  HIPRT_HD PlacedPoint into(const InstanceRecord& instance, const Box& bounds) const {
    PlacedPoint inner;
    inner.at = point_to_object(instance, at);
    const LinearInverse inverse(instance);
    const double norm = affine_detail::norm(instance.linear), inverse_norm = inverse.norm();
    const double far =
        max_component(at) + max_of(max_of(absolute(instance.translation[0]), absolute(instance.translation[1])),
                                   absolute(instance.translation[2]));
    inner.error = norm * fused_multiply_add(0x1p-50, far, error);
    inner.stretch_squared = stretch_squared * hiprt::stretch_squared(instance);
    inner.growth = growth * inverse_norm;
    const double own = 0x1p-48 * ((1.0 + inverse_norm * norm) * inverse_norm * magnitude(bounds) + far);
    inner.vertex_error = fused_multiply_add(growth, own, vertex_error);
    return inner;
  }
};

}  // namespace region_detail

/// @tparam kLevels the most instances that it is in.
template <class Lanes, unsigned kLevels> class PointRegion {
  using PlacedPoint = region_detail::PlacedPoint;

 public:
  /// @param squared the largest squared distance that counts.
  HIPRT_HD HIPRT_FORCE_INLINE PointRegion(const SceneView& scene, const Vec3D& point, double squared)
      : here_{.at = point}, squared_(squared) {
    set_place(scene.bounds);
  }

  template <class Node> HIPRT_HD HIPRT_FORCE_INLINE BoxHits<Lanes> boxes(const Node& node) const {
    return near_boxes<Lanes>(node, box_, limit_);
  }
  HIPRT_HD HIPRT_FORCE_INLINE float far_end() const { return limit_; }
  /// Bit i: triangle i of a leaf is certainly farther.
  template <class Leaf> HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t outside(const Leaf& leaf) const {
    return farther_triangles<Lanes>(leaf, rounded_, filter_limit_);
  }
  /// Whether a custom primitive's box is certainly farther.
  HIPRT_HD HIPRT_FORCE_INLINE bool outside(const Box& box) const { return is_farther<Lanes>(box, box_, limit_); }
  HIPRT_HD HIPRT_FORCE_INLINE double squared() const { return squared_; }
  /// The query's point, as the object at hand sees it.
  HIPRT_HD HIPRT_FORCE_INLINE PointInObject in_object(float time) const {
    return {here_.at, squared_ * here_.stretch_squared * (1.0 + 0x1p-20), time};
  }
  /// @param squared not more than before.
  HIPRT_HD HIPRT_FORCE_INLINE void shrink(double squared) {
    squared_ = squared;
    set_limit();
  }

  HIPRT_HD HIPRT_FORCE_INLINE void enter(const InstanceRecord& instance, const ObjectRecord& object) {
    if constexpr (kLevels != 0) {
      outside_.state[outside_.depth++] = {here_, box_, rounded_, margin_};
      here_ = here_.into(instance, object.bounds);
      set_place(object.bounds);
    }
  }
  HIPRT_HD HIPRT_FORCE_INLINE void leave() {
    if constexpr (kLevels != 0) {
      const State& state = outside_.state[--outside_.depth];
      here_ = state.here;
      box_ = state.box;
      rounded_ = state.rounded;
      margin_ = state.margin;
      set_limit();
    }
  }

 private:
  struct State {
    PlacedPoint here;
    PointBox<Lanes> box;
    Vec3 rounded;
    double margin;
  };
  struct Outside {
    State state[kLevels == 0 ? 1 : kLevels];
    unsigned depth = 0;
  };
  struct Nothing {};

  HIPRT_HD HIPRT_FORCE_INLINE void set_place(const Box& bounds) {
    margin_ = here_.margin(bounds);
    box_ = PointBox<Lanes>(here_.at, margin_);
    rounded_ = {nearest_float(here_.at.x), nearest_float(here_.at.y), nearest_float(here_.at.z)};
    const Vec3D moved = here_.at - Vec3D(rounded_);
    margin_ += max_component(moved);
    set_limit();
  }
  HIPRT_HD HIPRT_FORCE_INLINE void set_limit() {
    const double squared = squared_ * here_.stretch_squared;
    limit_ = squared_limit(squared);
    filter_limit_ = filter_limit(squared, margin_);
  }

  PlacedPoint here_;
  PointBox<Lanes> box_;
  Vec3 rounded_;   ///< here_.at in float.
  double margin_;  ///< How far the point and the vertices may be from where floats have them.
  double squared_;
  float limit_;         ///< For boxes.
  float filter_limit_;  ///< For triangles.
  [[no_unique_address]] std::conditional_t<kLevels == 0, Nothing, Outside> outside_;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
