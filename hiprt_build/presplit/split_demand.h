#pragma once
/// How many spatial splits a scene asks for: the budget where BuildOptions::split_budget is not set. Internal.
///
/// The box of a long diagonal triangle is many times as large as the triangle, and rays that miss the triangle enter
/// it. Boxes around k parts of such a triangle have a k-th of the area in all.

#include <hiprt_build/format/box.h>
#include <hiprt_build/presplit/presplit_steps.h>

#include <algorithm>
#include <cmath>

namespace hiprt::build {

/// Sums over the leaves of a scene, in units of 2^-36 of the area of its bounds. They are whole numbers, so they do not
/// depend on the order.
struct SplitDemand {
  unsigned long long boxes;  ///< Areas of the leaves' boxes.
  unsigned long long least;  ///< What they come down to with ever more splits.

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

/// @param least the builder's own budget. @param most the largest budget that fits.
/// @return 3/8 of the root of the factor by which boxes are too large, from @p least up to 8. Factors of usual scenes
/// are 1 to 10; 16 gives 1.5, 455 gives 8. p times as many parts make boxes p times as small, so memory and work are
/// balanced near the root.
inline double split_budget_for(const SplitDemand& demand, double least, double most) {
  if (demand.least == 0) return least;
  const double factor = static_cast<double>(demand.boxes) / static_cast<double>(demand.least);
  return std::max(least, std::min({0.375 * std::sqrt(factor), 8.0, most}));
}

}  // namespace hiprt::build
