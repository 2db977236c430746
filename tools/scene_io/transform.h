#pragma once
/// Affine transforms of meshes and nodes, in double.

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>
#include <hiprt_build/instances.h>

#include <array>

namespace hiprt::tools {

/// 4 x 4 without its last row (0, 0, 0, 1): m[row][column].
struct Transform {
  std::array<std::array<double, 4>, 3> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  /// Computed in double and rounded once.
  build::Position operator()(const build::Position& p) const;
  /// First @p inner, then this one.
  Transform operator*(const Transform& inner) const;
  /// Does it turn the outside of a mesh inside?
  bool mirrors() const;
};

/// Takes normals where a transform takes surfaces: its inverse, transposed. Outsides stay outside, also where it
/// mirrors, and where it makes surfaces flat.
class NormalTransform {
 public:
  explicit NormalTransform(const Transform& transform);
  /// @return of length 1; 0 if @p normal is 0 or not finite, or if nothing of it is left.
  std::array<float, 3> operator()(const std::array<float, 3>& normal) const;

 private:
  std::array<std::array<double, 3>, 3> m_{};
};

Transform to_double(const build::Affine& affine);
/// Every number rounded; those that are too large become infinite.
build::Affine to_float(const Transform& transform);

/// Scale first, then rotation, then translation, as glTF's nodes have them.
struct Placement {
  std::array<double, 3> translation{0, 0, 0};
  std::array<double, 4> rotation{0, 0, 0, 1};  ///< A quaternion: x, y, z, w.
  std::array<double, 3> scale{1, 1, 1};
};

/// Files round quaternions: those of length 1 to within 0.001 are taken for rotations.
/// @return kInvalidInput with "rotation has the length ..." for others.
build::Result<Transform> transform_of(const Placement& placement);

}  // namespace hiprt::tools
