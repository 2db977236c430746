#pragma once
/// Transforms of points, directions and normals between a scene and an object in it, along a path of instances, with
/// error bounds.
///
///     const hiprt::PathTransform to_object(scene, hit.path, ray.time);
///     const hiprt::Bounded corner = to_object.point_to_scene({vertex});

#include <hiprt_device/instances/levels.h>
#include <hiprt_device/intersect/box_test.h>

namespace hiprt {

/// A vector, and a bound per axis of its distance from the exact vector.
struct Bounded {
  Vec3 value;
  float error = 0.0f;
};

inline namespace HIPRT_ISA_NAMESPACE {

/// The transforms of a path at a time, still or moving.
///
/// The exact transform is that of the file's records (FORMAT.md, Instances and Motion). docs/proofs/instances.md and
/// docs/proofs/motion.md derive the bounds. Normals do not keep their length.
template <unsigned kLevels> class PathTransform {
 public:
  /// @param path of a hit in the scene, or a path that ends earlier.
  /// @param time of the ray; it has no effect where nothing moves.
  HIPRT_HD PathTransform(const SceneView& scene, const InstancePath<kLevels>& path, float time = 0.0f) {
    follow(scene, path, time, [&](const InstanceRecord& record, const ObjectRecord&, const MotionRecord* motion) {
      steps_[depth_++] = {record, motion == nullptr ? 0.0f : 14.0f * kUnit * motion->rounding,
                          motion == nullptr ? 0.0f : 6.0f * kUnit * motion->farthest};
    });
  }

  /// From the scene to the object.
  HIPRT_HD Bounded point_to_object(Bounded p) const {
    for (unsigned i = 0; i < depth_; ++i) {
      const float(&t)[3] = steps_[i].record.translation;
      const Vec3 from(p.value.x - t[0], p.value.y - t[1], p.value.z - t[2]);
      const float outside = p.error + steps_[i].turn * sum(from) + steps_[i].shift;
      p = {hiprt::point_to_object(steps_[i].record, p.value), into(steps_[i].record, from, outside)};
    }
    return p;
  }
  HIPRT_HD Bounded vector_to_object(Bounded v) const {
    for (unsigned i = 0; i < depth_; ++i) {
      const float outside = v.error + steps_[i].turn * sum(v.value);
      v = {hiprt::vector_to_object(steps_[i].record, v.value), into(steps_[i].record, v.value, outside)};
    }
    return v;
  }
  HIPRT_HD Bounded normal_to_object(Bounded n) const {
    for (unsigned i = 0; i < depth_; ++i) {
      const LinearInverse inverse(steps_[i].record);
      const float outside = n.error + steps_[i].turn * sum(n.value);
      const Vec3 inside = hiprt::normal_to_object(steps_[i].record, n.value);
      n = {inside, back(steps_[i].record, inverse, n.value, outside, true) + rounded(inside)};
    }
    return n;
  }

  /// From the object to the scene.
  HIPRT_HD Bounded point_to_scene(Bounded p) const {
    for (unsigned i = depth_; i-- > 0;) {
      const LinearInverse inverse(steps_[i].record);
      const float(&t)[3] = steps_[i].record.translation;
      const Vec3 outside = hiprt::point_to_scene(steps_[i].record, p.value);
      const Vec3 from(outside.x - t[0], outside.y - t[1], outside.z - t[2]);
      p = {outside, back(steps_[i].record, inverse, p.value, p.error, false) + rounded(outside) +
                        steps_[i].turn * sum(from) + steps_[i].shift};
    }
    return p;
  }
  HIPRT_HD Bounded vector_to_scene(Bounded v) const {
    for (unsigned i = depth_; i-- > 0;) {
      const LinearInverse inverse(steps_[i].record);
      const Vec3 outside = hiprt::vector_to_scene(steps_[i].record, v.value);
      v = {outside,
           back(steps_[i].record, inverse, v.value, v.error, false) + rounded(outside) + steps_[i].turn * sum(outside)};
    }
    return v;
  }
  HIPRT_HD Bounded normal_to_scene(Bounded n) const {
    for (unsigned i = depth_; i-- > 0;) {
      const float(&m)[3][3] = steps_[i].record.linear;
      const Vec3 outside = hiprt::normal_to_scene(steps_[i].record, n.value);
      float most = 0.0f, rows = 0.0f;
      for (unsigned c = 0; c < 3; ++c) {
        const float x = absolute(m[0][c]), y = absolute(m[1][c]), z = absolute(m[2][c]);
        most = max_of(most, x * absolute(n.value.x) + y * absolute(n.value.y) + z * absolute(n.value.z));
        rows = max_of(rows, x + y + z);
      }
      n = {outside, up(rows * n.error + 4.0f * kUnit * most + steps_[i].turn * sum(outside))};
    }
    return n;
  }

 private:
  static constexpr float kUnit = 0x1p-24f;
  /// An instance at the time.
  struct Step {
    InstanceRecord record;
    float turn;   ///< Error of the linear part, relative to a vector outside.
    float shift;  ///< Error of the translation.
  };

  HIPRT_HD static float sum(const Vec3& v) { return absolute(v.x) + absolute(v.y) + absolute(v.z); }
  /// Error of a result that was rounded once.
  HIPRT_HD static float rounded(const Vec3& v) { return kUnit * max_component(v); }
  /// Increases a bound by the rounding of its own computation.
  HIPRT_HD static float up(float bound) { return bound * (1.0f + 16.0f * kUnit); }

  /// The error of linear * v, where v has the error @p outside and the product rounds.
  HIPRT_HD static float into(const InstanceRecord& record, const Vec3& v, float outside) {
    float most = 0.0f, rows = 0.0f;
    for (const float(&row)[3] : record.linear) {
      const float x = absolute(row[0]), y = absolute(row[1]), z = absolute(row[2]);
      most = max_of(most, x * absolute(v.x) + y * absolute(v.y) + z * absolute(v.z));
      rows = max_of(rows, x + y + z);
    }
    return up(rows * outside + 5.0f * kUnit * most);
  }
  /// The error of inverse * v (transposed: of transpose(inverse) * v), where v has the error @p error.
  ///
  /// The inverse has the error that double precision leaves, as in StillInstanceBounds.
  HIPRT_HD static float back(const InstanceRecord& record, const LinearInverse& inverse, const Vec3& v, float error,
                             bool transposed) {
    double norm = 0.0, linear = 0.0;
    for (unsigned r = 0; r < 3; ++r) {
      double of_inverse = 0.0, of_linear = 0.0;
      for (unsigned c = 0; c < 3; ++c) {
        of_inverse += LinearInverse::size(transposed ? inverse.row[c][r] : inverse.row[r][c]);
        of_linear += LinearInverse::size(static_cast<double>(transposed ? record.linear[c][r] : record.linear[r][c]));
      }
      norm = of_inverse > norm ? of_inverse : norm;
      linear = of_linear > linear ? of_linear : linear;
    }
    const double unit = 0x1p-48 * (1.0 + norm * linear) * norm;
    return up(static_cast<float>(norm * static_cast<double>(error) + unit * static_cast<double>(sum(v))));
  }

  Step steps_[kLevels == 0 ? 1 : kLevels] = {};
  unsigned depth_ = 0;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
