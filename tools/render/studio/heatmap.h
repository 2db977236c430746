#pragma once
/// The cost of a picture's rays as colours.

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

/// Writes viridis(cost / top) into the colours and draws the legend with a histogram of
/// the pixels' costs.
/// @param cost tests (of boxes and leaves) and instances per primary ray of each pixel, the mean of its samples.
void apply_heatmap(Image& image, std::span<const float> cost);

}  // namespace hiprt::tools
