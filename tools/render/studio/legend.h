#pragma once
/// A colour bar with numbers, drawn into a picture.

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

/// Parts of the range that a histogram may tell apart, at most.
inline constexpr std::size_t kLegendParts = 40;

/// What a colour stands for.
struct LegendScale {
  std::string_view title;  ///< ASCII.
  unsigned top;            ///< The value at the bar's right end; a multiple of 4, because there are five numbers.
  bool clipped;            ///< Larger values have the last colour too: a plus follows the last number.
  /// How many pixels have the values of each of so many equal parts of the range, kLegendParts or a number that divides
  /// it: columns above the bar, as high as the square roots. Empty: none are drawn.
  std::span<const std::uint64_t> histogram{};
};

/// Draws the legend at the bottom left into the colours, as large as suits the picture.
/// @return where it is, or nothing when the picture is too small for it (200 x 48 pixels, with
/// a histogram 200 x 71).
std::optional<LegendArea> draw_legend(Image& image, const LegendScale& scale);

}  // namespace hiprt::tools
