#pragma once
/// Filters of FLIP (tools/render/image/flip.h), as products of one-dimensional ones.

#include <cstddef>
#include <vector>

namespace hiprt::tools {

/// Pixels per degree of visual angle: a screen of 0.7 m and 3840 pixels, seen from 0.7 m.
inline constexpr double kPixelsPerDegree = 67.0;

/// Weights at -radius to radius. In double precision: of features the root is taken, which makes float's errors
/// visible.
using Kernel = std::vector<double>;

/// Of one picture's pixels. Each is k(x) k(y), or the product of two, or the sum of two products.
struct FlipFilters {
  std::size_t sensitivity_radius, feature_radius;
  /// Contrast sensitivity; each sums to 1 in two dimensions, blue-yellow's both together.
  Kernel achromatic, red_green, blue_yellow_first, blue_yellow_second;
  /// A Gaussian, and its first and second derivatives; positive weights sum to 1, negative ones to -1.
  Kernel smooth, slope, curvature;
};

/// Of kPixelsPerDegree.
FlipFilters flip_filters();

/// out[x] = the sum of weights[k] * first[k * stride + x], for x in [0, width).
void weighted_sum(const double* first, std::size_t stride, const Kernel& weights, double* out, std::size_t width);

}  // namespace hiprt::tools
