#pragma once
/// Affine transforms of meshes and nodes, in double.

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <array>

namespace hiprt::build {
struct Affine;
}  // namespace hiprt::build

namespace hiprt::tools {

/// 4 x 4 without its last row (0, 0, 0, 1): m[row][column].
struct Transform {
  std::array<std::array<double, 4>, 3> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  /// Computed in double and rounded once.
  build::Position operator()(const build::Position& p) const;
  /// Applies @p inner first.
  Transform operator*(const Transform& inner) const;
  /// Whether it turns the outside of a mesh inside.
  bool mirrors() const;
};

/// Transforms normals: the inverse, transposed. The outside stays outside, also if the transform mirrors or flattens.
class NormalTransform {
 public:
  explicit NormalTransform(const Transform& transform);
  /// @return of length 1; 0 if @p normal is 0 or not finite, or if nothing of it is left.
  std::array<float, 3> operator()(const std::array<float, 3>& normal) const;

 private:
  std::array<std::array<double, 3>, 3> m_{};
};

Transform to_double(const build::Affine& affine);
/// Rounds every number. Numbers that are too large become infinite.
build::Affine to_float(const Transform& transform);

/// Scale first, then rotation, then translation, as glTF's nodes have them.
struct Placement {
  std::array<double, 3> translation{0, 0, 0};
  std::array<double, 4> rotation{0, 0, 0, 1};  ///< A quaternion: x, y, z, w.
  std::array<double, 3> scale{1, 1, 1};
};

/// Files round quaternions: a length of 1 within 0.001 is accepted.
/// @return kInvalidInput with "rotation has the length ..." for others.
build::Result<Transform> transform_of(const Placement& placement);

}  // namespace hiprt::tools
