#pragma once
/// Draws a colour bar with numbers into a picture.

#include <tools/render/image/image.h>

#include <optional>
#include <span>
#include <string_view>

namespace hiprt::tools {

/// Where the legend is, in pixels; right and bottom are exclusive.
struct LegendArea {
  std::uint32_t left, top, right, bottom;                  ///< The dark panel.
  std::uint32_t bar_left, bar_top, bar_right, bar_bottom;  ///< The colours from 0 (left) to the top of the range.
};

/// Most columns of a histogram.
inline constexpr std::size_t kLegendParts = 40;

/// The meaning of the colours.
struct LegendScale {
  std::string_view title;  ///< ASCII.
  unsigned top;            ///< The value at the bar's right end; a multiple of 4, because there are five numbers.
  bool clipped;            ///< Some values are above `top`: a plus follows the last number.
  /// Pixels per equal part of the range. The number of parts divides kLegendParts. Columns above the bar show the
  /// square roots. Empty: no histogram.
  std::span<const std::uint64_t> histogram{};
};

/// Draws the legend at the bottom left, with a size that suits the picture.
/// @return its area, or nothing if the picture is smaller than 200 x 48 pixels (200 x 71 with a histogram).
std::optional<LegendArea> draw_legend(Image& image, const LegendScale& scale);

}  // namespace hiprt::tools
