#pragma once
/// The transforms of instances. Internal.

#include <hiprt/impl/surface.h>
#include <hiprt_device/instances/transform.h>

namespace hiprt::compat_detail {
inline namespace HIPRT_ISA_NAMESPACE {

/// The instances that lead to an object, at a time.
struct PlacedPath {
  InstanceRecord record[hiprtMaxInstanceLevels];
  unsigned depth = 0;

  HIPRT_HD PlacedPath(hiprtScene scene, std::uint32_t instance, float time) : depth(1) {
    record[0] = ObjectView(view_of(scene)).instance<true>(instance, time);
  }
  /// Follows the numbers while instances are scenes.
  HIPRT_HD PlacedPath(hiprtScene handle, const std::uint32_t (&instances)[hiprtMaxInstanceLevels], float time) {
    const SceneView& scene = view_of(handle);
    ObjectView view(scene);
    while (depth < hiprtMaxInstanceLevels && view.instances != nullptr && instances[depth] != hiprtInvalidValue) {
      record[depth] = view.instance<true>(instances[depth], time);
      view = ObjectView(scene, scene.objects[record[depth++].object]);
    }
  }

  HIPRT_HD Vec3 point_to_object(Vec3 p) const {
    for (unsigned i = 0; i < depth; ++i) p = hiprt::point_to_object(record[i], p);
    return p;
  }
  HIPRT_HD Vec3 point_to_scene(Vec3 p) const {
    for (unsigned i = depth; i-- > 0;) p = hiprt::point_to_scene(record[i], p);
    return p;
  }
  HIPRT_HD Vec3 normal_to_object(Vec3 n) const {
    for (unsigned i = 0; i < depth; ++i) n = hiprt::normal_to_object(record[i], n);
    return n;
  }
  HIPRT_HD Vec3 normal_to_scene(Vec3 n) const {
    for (unsigned i = depth; i-- > 0;) n = hiprt::normal_to_scene(record[i], n);
    return n;
  }
};

/// Rows of a matrix whose column 3 is the translation.
struct DoubleFrame {
  double row[3][4];

  HIPRT_HD static DoubleFrame identity() {
    return {{{1.0, 0.0, 0.0, 0.0}, {0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0, 0.0}}};
  }
  /// From the world to the object.
  HIPRT_HD static DoubleFrame to_object(const InstanceRecord& record) {
    DoubleFrame frame;
    for (unsigned r = 0; r < 3; ++r) {
      double moved = 0.0;
      for (unsigned c = 0; c < 3; ++c) {
        frame.row[r][c] = static_cast<double>(record.linear[r][c]);
        moved -= frame.row[r][c] * static_cast<double>(record.translation[c]);
      }
      frame.row[r][3] = moved;
    }
    return frame;
  }
  HIPRT_HD static DoubleFrame to_world(const InstanceRecord& record) {
    const LinearInverse inverse(record);
    DoubleFrame frame;
    for (unsigned r = 0; r < 3; ++r) {
      for (unsigned c = 0; c < 3; ++c) frame.row[r][c] = inverse.row[r][c];
      frame.row[r][3] = static_cast<double>(record.translation[r]);
    }
    return frame;
  }
  /// The frame that applies @p first, then this one.
  HIPRT_HD DoubleFrame after(const DoubleFrame& first) const {
    DoubleFrame frame;
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 4; ++c) {
        frame.row[r][c] = c == 3 ? row[r][3] : 0.0;
        for (unsigned k = 0; k < 3; ++k) frame.row[r][c] += row[r][k] * first.row[k][c];
      }
    return frame;
  }
  HIPRT_HD hiprtFrameMatrix matrix(float time) const {
    hiprtFrameMatrix result;
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 4; ++c) result.matrix[r][c] = static_cast<float>(row[r][c]);
    result.time = time;
    return result;
  }
};

HIPRT_HD inline DoubleFrame world_frame(const PlacedPath& path) {
  DoubleFrame frame = DoubleFrame::identity();
  for (unsigned i = path.depth; i-- > 0;) frame = DoubleFrame::to_world(path.record[i]).after(frame);
  return frame;
}
HIPRT_HD inline DoubleFrame object_frame(const PlacedPath& path) {
  DoubleFrame frame = DoubleFrame::identity();
  for (unsigned i = 0; i < path.depth; ++i) frame = DoubleFrame::to_object(path.record[i]).after(frame);
  return frame;
}

/// The scale, rotation and translation of a matrix; its shear is dropped.
///
/// matrix = rotation * scale * shear, with a shear of unit diagonal (Gram-Schmidt on the columns). A mirror shows as a
/// negative scale along z.
HIPRT_HD inline hiprtFrameSRT without_shear(const DoubleFrame& frame, float time) {
  double column[3][3], scale[3];
  for (unsigned c = 0; c < 3; ++c) {
    for (unsigned r = 0; r < 3; ++r) column[c][r] = frame.row[r][c];
    for (unsigned before = 0; before < c; ++before) {
      double along = 0.0;
      for (unsigned r = 0; r < 3; ++r) along += column[before][r] * column[c][r];
      for (unsigned r = 0; r < 3; ++r) column[c][r] -= along * column[before][r];
    }
    double squared = 0.0;
    for (unsigned r = 0; r < 3; ++r) squared += column[c][r] * column[c][r];
    scale[c] = square_root(squared);
    for (unsigned r = 0; r < 3; ++r) column[c][r] /= scale[c];
  }
  const double(&x)[3] = column[0], (&y)[3] = column[1], (&z)[3] = column[2];
  const double determinant =
      x[0] * (y[1] * z[2] - y[2] * z[1]) - y[0] * (x[1] * z[2] - x[2] * z[1]) + z[0] * (x[1] * y[2] - x[2] * y[1]);
  if (determinant < 0.0) {
    scale[2] = -scale[2];
    for (double& component : column[2]) component = -component;
  }
  // The quaternion's largest component comes from the diagonal, the others from sums with it (Shepperd 1978).
  const double trace = x[0] + y[1] + z[2];
  const double square[4] = {1.0 + 2.0 * x[0] - trace, 1.0 + 2.0 * y[1] - trace, 1.0 + 2.0 * z[2] - trace, 1.0 + trace};
  unsigned largest = 3;
  for (unsigned k = 0; k < 3; ++k)
    if (square[k] > square[largest]) largest = k;
  const double size = square_root(square[largest]), half = 0.5 / size;
  double q[4];
  q[largest] = 0.5 * size;
  if (largest == 3) {
    q[0] = (y[2] - z[1]) * half;
    q[1] = (z[0] - x[2]) * half;
    q[2] = (x[1] - y[0]) * half;
  } else {
    const unsigned a = largest, b = (a + 1) % 3, c = (a + 2) % 3;
    q[b] = (column[a][b] + column[b][a]) * half;
    q[c] = (column[a][c] + column[c][a]) * half;
    q[3] = (column[b][c] - column[c][b]) * half;
  }
  const double sine = square_root(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
  hiprtFrameSRT result;
  result.rotation = hiprtFloat4{0.0f, 0.0f, 1.0f, 0.0f};
  if (sine > 0.0)
    result.rotation =
        hiprtFloat4{static_cast<float>(q[0] / sine), static_cast<float>(q[1] / sine), static_cast<float>(q[2] / sine),
                    2.0f * atan2f(static_cast<float>(sine), static_cast<float>(q[3]))};
  result.scale = hiprtFloat3{static_cast<float>(scale[0]), static_cast<float>(scale[1]), static_cast<float>(scale[2])};
  result.translation = hiprtFloat3{static_cast<float>(frame.row[0][3]), static_cast<float>(frame.row[1][3]),
                                   static_cast<float>(frame.row[2][3])};
  result.time = time;
  return result;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::compat_detail
