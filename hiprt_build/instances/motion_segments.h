#pragma once
/// The records of a motion.

#include <hiprt_build/format/motion_bounds.h>
#include <hiprt_build/motion.h>

#include <vector>

namespace hiprt::build {

struct MotionParts {
  MatrixKey first;                      ///< Where the instance is at the first key with an inverse.
  std::vector<MotionSegment> segments;  ///< None: it stands still there.
  MotionMagnification magnification;
};

/// @return kInvalidInput with the key and what is wrong with it.
Result<MotionParts> make_motion(const Motion& motion);

}  // namespace hiprt::build
