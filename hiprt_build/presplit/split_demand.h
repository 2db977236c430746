#pragma once
/// How many spatial splits a scene needs: the budget of kSplitsAsNeeded. Internal.
///
/// The box of a long diagonal triangle is many times as large as the triangle. Most rays that enter the box miss the
/// triangle. If such a triangle is split into k parts, the boxes of the parts have 1/k of the area in all.

#include <hiprt_build/format/box.h>
#include <hiprt_build/presplit/presplit_steps.h>

#include <algorithm>
#include <cmath>

namespace hiprt::build {

/// Sums over the leaves of a scene, in units of 2^-36 of the area of its bounds. They are integers, so they do not
/// depend on the order of summation.
struct SplitDemand {
  unsigned long long boxes;  ///< Areas of the leaves' boxes.
  unsigned long long least;  ///< Their limit with ever more splits: least_area().

  /// @param scene area of its bounds, as half_area(). @param box of the leaf. @param corners,pair its triangles.
  HIPRT_HD static SplitDemand of(float scene, const Box& box, const LeafCorners& corners, bool pair) {
    return {in_units(half_area(box), scene), in_units(least_area(corners, pair), scene)};
  }
  HIPRT_HD void add(const SplitDemand& other) {
    boxes += other.boxes;
    least += other.least;
  }

 private:
  HIPRT_HD static unsigned long long in_units(float area, float scene) {
    constexpr float kScene = 0x1p36f;
    const float units = area / scene * kScene;
    // Also where it is not a number.
    return units >= 0.0f ? static_cast<unsigned long long>(units < kScene ? units : kScene) : 0;
  }
};

/// @param least the builder's default budget. @param most the largest budget that the caller can hold.
/// @return 3/8 of the square root of boxes / least, but at least @p least and at most 8. A ratio of 16 gives 1.5 (the
/// default of kSbvh), 64 gives 3 (kHq), 455 gives 8. Nine benchmark scenes had ratios from 1 to 10, p_pipes 480.
inline double split_budget_for(const SplitDemand& demand, double least, double most) {
  if (demand.least == 0) return least;
  const double factor = static_cast<double>(demand.boxes) / static_cast<double>(demand.least);
  return std::max(least, std::min({0.375 * std::sqrt(factor), 8.0, most}));
}

}  // namespace hiprt::build
