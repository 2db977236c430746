#pragma once
/// Motion of instances: keys at times that the program chooses.
///
///     hiprt::build::Motion wheel{.keys = {{.time = 0}, {.time = 1, .rotation = {0, 0, 1, 0}}}};
///     hiprt::build::Instance turning{.object = 0, .motion = &wheel};

#include <hiprt_build/error.h>
#include <hiprt_build/export.h>
#include <hiprt_device/format/motion.h>

#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// Rows of a 3 x 4 matrix, as glTF, OptiX and HIPRT have them: column 3 is the translation.
struct Affine {
  float row[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
};

/// A transform in parts: a point p of the object is at rotation * (U p) + translation. U is the upper triangular matrix
/// of scale (its diagonal) and shear.
struct MotionKey {
  float time = 0.0f;
  float translation[3] = {};
  float rotation[4] = {0, 0, 0, 1};  ///< Quaternion (x, y, z, w) of any length but 0.
  float scale[3] = {1, 1, 1};        ///< Not 0, and of the same sign in all keys. Negative ones mirror. See Motion.
  float shear[3] = {};               ///< xy, xz, yz: what y adds to x, z to x and z to y.
};

/// A transform as a matrix.
struct MatrixKey {
  float time = 0.0f;
  Affine to_scene{};
};

/// The transforms of an instance over time. Between two keys translation, scale and shear change linearly, and the
/// rotation takes the shorter arc (MotionKind). Outside its keys the instance does not move.
///
/// A key may scale the instance to nothing: its scale and shear, or the 3 x 3 part of its matrix, are 0. The instance
/// shrinks towards that key and grows behind it. At the key, and between two such keys, it is hidden: no ray hits it.
struct Motion {
  /// In ascending order of time, no two at the same time. One key: the instance does not move.
  std::vector<MotionKey> keys{};
  MotionKind kind = MotionKind::kSlerp;
  std::vector<MatrixKey> matrices{};  ///< Instead of keys. Kinds other than kMatrix decompose() them.
};

/// What is wrong with the keys of a motion.
enum class MotionFault : std::uint32_t {
  kNone = 0,
  kNotFinite = 1,   ///< A number of a key.
  kNoRotation = 2,  ///< A quaternion of length 0.
  kZeroScale = 3,   ///< Some of them; all 0 would hide the instance.
  kSignChange = 4,  ///< Of a scale, from the key before.
  kNoInverse = 5,   ///< A matrix.
  kBadTime = 6,     ///< Not finite, not after the key before, or too far from it.
  kSingular = 7,    ///< Between the key and the next.
  kBadKeys = 8,     ///< On the device: keys that are not there.
  kHidden = 9,      ///< All keys hide the instance.
};

/// Decomposes a matrix by Gram-Schmidt orthogonalization. Two mirrored axes become a rotation, so that the result is
/// unique. Its error is a few units in the last place of the matrix.
/// @return kInvalidInput for a matrix that is not finite or has no inverse.
HIPRT_BUILD_API Result<MotionKey> decompose(const MatrixKey& key);
/// The inverse of decompose().
HIPRT_BUILD_API MatrixKey compose(const MotionKey& key);

}  // namespace hiprt::build
