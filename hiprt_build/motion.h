#pragma once
/// How instances move: keys at times of the program's choice.
///
///     hiprt::build::Motion wheel{.keys = {{.time = 0}, {.time = 1, .rotation = {0, 0, 1, 0}}}};
///     hiprt::build::Instance turning{.object = 0, .motion = &wheel};

#include <hiprt_build/error.h>
#include <hiprt_build/export.h>
#include <hiprt_device/format/motion.h>

#include <span>
#include <vector>

namespace hiprt::build {

/// Rows of a 3 x 4 matrix, as glTF, OptiX and HIPRT have them: column 3 is the translation.
struct Affine {
  float row[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
};

/// A place in parts: a point p of the object is at rotation * (U p) + translation, U the upper triangle of scale (its
/// diagonal) and shear.
struct MotionKey {
  float time = 0.0f;
  float translation[3] = {};
  float rotation[4] = {0, 0, 0, 1};  ///< Quaternion (x, y, z, w) of any length but 0.
  float scale[3] = {1, 1, 1};        ///< Not 0, and of the same sign in all keys. Negative ones mirror.
  float shear[3] = {};               ///< xy, xz, yz: what y adds to x, z to x and z to y.
};

/// A place as a matrix.
struct MatrixKey {
  float time = 0.0f;
  Affine to_scene{};
};

/// The way of an instance through its keys. Between two keys translation, scale and shear change linearly and the
/// rotation takes the shorter way around (MotionKind); outside its keys the instance stands still.
struct Motion {
  /// In the order of their times, which differ, by any amounts. One key: the instance stands still there.
  std::vector<MotionKey> keys{};
  MotionKind kind = MotionKind::kSlerp;
  std::vector<MatrixKey> matrices{};  ///< In place of keys. Of other kinds than kMatrix: see decompose().
};

/// A matrix in parts, by Gram and Schmidt: unique but for rotations of scales of (-1, -1, 1), which come as rotations.
/// The key is off by a few units in the last place of the matrix.
/// @return kInvalidInput for a matrix that is not finite or without an inverse.
HIPRT_BUILD_API Result<MotionKey> decompose(const MatrixKey& key);
/// The way back.
HIPRT_BUILD_API MatrixKey compose(const MotionKey& key);

}  // namespace hiprt::build
