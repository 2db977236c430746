#pragma once
/// Errors of hits, compared with exact arithmetic (tests/oracle).

#include "engine.h"

#include <string>
#include <vector>

namespace hiprt::bench {

/// Rays with their exact closest hits.
struct ErrorCase {
  Model model;
  std::vector<Ray> rays;
  struct Truth {
    std::uint32_t primitive;
    double t;
  };
  std::vector<Truth> truths;
};

/// Meshes and rays that stress the triangle test: shared edges, vertices, needles, slivers, far from the origin, tiny
/// and huge. In exact arithmetic every ray hits. @param rays per case.
std::vector<ErrorCase> error_cases(unsigned rays);

struct Spread {
  double median = 0.0, p999 = 0.0, largest = 0.0;
};

/// @param values in any order.
Spread spread(std::vector<double> values);

struct Errors {
  std::uint64_t rays = 0;
  std::uint64_t missed = 0;  ///< Rays without a hit.
  std::uint64_t wrong = 0;   ///< Hits whose t differs by more than 1 %: another surface.
  std::uint64_t other = 0;   ///< Hits of a triangle that is farther than the closest one.
  /// Errors of hits of the right triangle. t: in units in the last place of the exact t. u, v: in units of 2^-24.
  /// point: distance of origin + t * direction from the triangle's plane. Its unit is that in the last place of the
  /// largest coordinate of the ray's origin and of the point.
  Spread t, u, v, point;
  std::uint64_t beyond_bound = 0;  ///< Hit points farther from the plane than Hit::error. Ours only.
};

Errors measure_errors(const ErrorCase& errors, std::span<const Hit> hits, bool has_bounds);

}  // namespace hiprt::bench
