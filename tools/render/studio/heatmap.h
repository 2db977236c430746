#pragma once
/// Shows the cost of rays as colours.

#include <tools/render/studio/legend.h>

#include <span>

namespace hiprt::tools {

/// The range of a heat map.
struct HeatRange {
  unsigned top;  ///< A round multiple of 4, at least 4, at or above 99.5 % of the pixels.
  bool clipped;  ///< Some pixel is above.
};

/// @param cost per pixel, not negative.
HeatRange heat_range(std::span<const float> cost);

/// Writes viridis(cost / top) into the colours and draws the legend with a histogram of the costs.
/// @param cost per pixel, the mean over its primary rays of tests (of boxes and leaves) plus entered instances.
void apply_heatmap(Image& image, std::span<const float> cost);

}  // namespace hiprt::tools
