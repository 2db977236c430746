#pragma once
/// How far answers are from the truth, which is computed exactly (tests/oracle).

#include "engine.h"

#include <string>
#include <vector>

namespace hiprt::bench {

/// Rays whose exact closest hits are known.
struct ErrorCase {
  Model model;
  std::vector<Ray> rays;
  struct Truth {
    std::uint32_t primitive;
    double t;
  };
  std::vector<Truth> truths;
};

/// Meshes and rays that tests of rays and triangles are compared by, all of which truly hit: shared edges, vertices,
/// needles, slivers, far from the origin, tiny and huge. @param rays of each.
std::vector<ErrorCase> error_cases(unsigned rays);

struct Spread {
  double median = 0.0, p999 = 0.0, largest = 0.0;
};

/// Of values in any order.
Spread spread(std::vector<double> values);

struct Errors {
  std::uint64_t rays = 0;
  std::uint64_t missed = 0;  ///< Hits that were not found.
  std::uint64_t wrong = 0;   ///< Hits whose t is off by more than 1 %: another surface.
  std::uint64_t other = 0;   ///< Hits of a triangle that is not, exactly, the closest or as close.
  /// Of hits of the right triangle. t: units in the last place of the exact t; u, v: units of 2^-24; point: distance of
  /// the point origin + t * direction from the triangle's plane, in units in the last place of the largest coordinate
  /// of the ray's origin and of the point.
  Spread t, u, v, point;
  std::uint64_t beyond_bound = 0;  ///< Points further from the plane than Hit::error says. Ours only.
};

Errors measure_errors(const ErrorCase& errors, std::span<const Hit> hits, bool has_bounds);

}  // namespace hiprt::bench
