#pragma once
/// Makes motions with scales of 0 such that they can be built.

#include <tools/scene_io/scene/scene_description.h>

#include <cstdint>
#include <string>

namespace hiprt::tools {

struct RepairedMotions {
  std::uint64_t flat_keys = 0;  ///< Keys that were flat.
  std::string first;            ///< Location of the first instance with one: "groups.forest[3]".
};

/// Thinner keys, as a part of their size, are flat: motions have a condition of 2^20 at most (kMaxMotionCondition).
inline constexpr double kFlat = 0x1p-19;
/// What flat keys get.
inline constexpr double kFlatThickness = 0x1p-16;

/// A key that scales an instance to nothing hides it (build::Motion), and stays. An instance that all keys hide stands
/// still and gets the mask 0. A flat key, for example with scale (1, 0, 1), gets a thickness of kFlatThickness: only so
/// can a ray be transformed to the instance.
RepairedMotions repair_motions(SceneDescription& scene);

}  // namespace hiprt::tools
