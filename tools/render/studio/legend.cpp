#include <tools/render/studio/legend.h>

#include <tools/render/studio/color_map.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace hiprt::tools {
namespace {

// Glyphs of 5 x 8 cells, the last row for the tails of p and y; lower-case words, digits, blank and plus.
constexpr std::uint32_t kGlyphWidth = 5, kGlyphHeight = 8, kAdvance = 6;

struct Glyph {
  char character;
  std::array<std::string_view, kGlyphHeight> rows;
};

constexpr std::array kFont{
    Glyph{'0', {" ### ", "#   #", "#  ##", "# # #", "##  #", "#   #", " ### ", "     "}},
    Glyph{'1', {"  #  ", " ##  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### ", "     "}},
    Glyph{'2', {" ### ", "#   #", "    #", "   # ", "  #  ", " #   ", "#####", "     "}},
    Glyph{'3', {" ### ", "#   #", "    #", "  ## ", "    #", "#   #", " ### ", "     "}},
    Glyph{'4', {"   # ", "  ## ", " # # ", "#  # ", "#####", "   # ", "   # ", "     "}},
    Glyph{'5', {"#####", "#    ", "#### ", "    #", "    #", "#   #", " ### ", "     "}},
    Glyph{'6', {"  ## ", " #   ", "#    ", "#### ", "#   #", "#   #", " ### ", "     "}},
    Glyph{'7', {"#####", "    #", "   # ", "  #  ", "  #  ", " #   ", " #   ", "     "}},
    Glyph{'8', {" ### ", "#   #", "#   #", " ### ", "#   #", "#   #", " ### ", "     "}},
    Glyph{'9', {" ### ", "#   #", "#   #", " ####", "    #", "   # ", " ##  ", "     "}},
    Glyph{'+', {"     ", "  #  ", "  #  ", "#####", "  #  ", "  #  ", "     ", "     "}},
    Glyph{'a', {"     ", "     ", " ### ", "    #", " ####", "#   #", " ####", "     "}},
    Glyph{'b', {"#    ", "#    ", "#### ", "#   #", "#   #", "#   #", "#### ", "     "}},
    Glyph{'c', {"     ", "     ", " ### ", "#   #", "#    ", "#   #", " ### ", "     "}},
    Glyph{'e', {"     ", "     ", " ### ", "#   #", "#####", "#    ", " ### ", "     "}},
    Glyph{'f', {"  ## ", " #   ", " #   ", "#### ", " #   ", " #   ", " #   ", "     "}},
    Glyph{'i', {"  #  ", "     ", " ##  ", "  #  ", "  #  ", "  #  ", " ### ", "     "}},
    Glyph{'l', {" ##  ", "  #  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### ", "     "}},
    Glyph{'n', {"     ", "     ", "# ## ", "##  #", "#   #", "#   #", "#   #", "     "}},
    Glyph{'o', {"     ", "     ", " ### ", "#   #", "#   #", "#   #", " ### ", "     "}},
    Glyph{'p', {"     ", "     ", "#### ", "#   #", "#   #", "#### ", "#    ", "#    "}},
    Glyph{'r', {"     ", "     ", "# ## ", "##   ", "#    ", "#    ", "#    ", "     "}},
    Glyph{'s', {"     ", "     ", " ####", "#    ", " ### ", "    #", "#### ", "     "}},
    Glyph{'t', {" #   ", " #   ", "#### ", " #   ", " #   ", " #   ", "  ## ", "     "}},
    Glyph{'x', {"     ", "     ", "#   #", " # # ", "  #  ", " # # ", "#   #", "     "}},
    Glyph{'y', {"     ", "     ", "#   #", "#   #", "#   #", " ####", "    #", " ### "}},
};

// The panel's layout in cells.
constexpr std::uint32_t kPadding = 4, kBarHeight = 10, kBarWidth = 160, kGap = 3, kTick = 2, kColumns = 20;
/// Room for half of the numbers below both ends of the bar.
constexpr std::uint32_t kSide = 16;
constexpr std::uint32_t kPanelWidth = kBarWidth + 2 * kSide;
constexpr std::uint32_t kPanelHeight = 2 * kPadding + 2 * kGlyphHeight + 2 * kGap + kBarHeight;
/// With a histogram: its columns, and a gap.
constexpr std::uint32_t kHistogramHeight = kColumns + kGap;
static_assert(kBarWidth % kLegendParts == 0);
constexpr std::uint32_t kMargin = 4;

constexpr Vec3 kInk{0.9f};

std::uint32_t text_width(std::string_view text) { return static_cast<std::uint32_t>(text.size()) * kAdvance - 1; }

/// A grid of cells of @p size pixels whose origin is the panel's corner.
class Canvas {
 public:
  Canvas(Image& image, std::uint32_t left, std::uint32_t top, std::uint32_t size)
      : image_(image), left_(left), top_(top), size_(size) {}

  void fill(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height, const Vec3& color) {
    for (std::uint32_t row = y * size_; row < (y + height) * size_; ++row)
      for (std::uint32_t column = x * size_; column < (x + width) * size_; ++column)
        image_.at(left_ + column, top_ + row).color = color;
  }
  void darken(std::uint32_t width, std::uint32_t height) {
    for (std::uint32_t row = 0; row < height * size_; ++row)
      for (std::uint32_t column = 0; column < width * size_; ++column)
        image_.at(left_ + column, top_ + row).color *= 0.08f;
  }
  void text(std::uint32_t x, std::uint32_t y, std::string_view text) {
    for (const char character : text) {
      glyph(x, y, character);
      x += kAdvance;
    }
  }
  /// Columns whose heights are as the counts' square roots (few pixels count, too); what is there at all is seen.
  void histogram(std::uint32_t x, std::uint32_t bottom, std::span<const std::uint64_t> counts) {
    const double most = static_cast<double>(*std::max_element(counts.begin(), counts.end()));
    const auto width = static_cast<std::uint32_t>(kBarWidth / counts.size());
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const auto height = static_cast<std::uint32_t>(
          std::ceil(kColumns * size_ * std::sqrt(static_cast<double>(counts[i]) / std::max(most, 1.0))));
      const Vec3 color = viridis((static_cast<float>(i) + 0.5f) / static_cast<float>(counts.size()));
      for (std::uint32_t row = 0; row < height; ++row)
        for (std::uint32_t column = 0; column < width * size_; ++column)
          image_
              .at(left_ + (x + static_cast<std::uint32_t>(i) * width) * size_ + column, top_ + bottom * size_ - 1 - row)
              .color = color;
    }
  }
  /// A bar of the colour map, pixel by pixel.
  void bar(std::uint32_t x, std::uint32_t y) {
    const std::uint32_t width = kBarWidth * size_;
    for (std::uint32_t column = 0; column < width; ++column) {
      const Vec3 color = viridis(static_cast<float>(column) / static_cast<float>(width - 1));
      for (std::uint32_t row = 0; row < kBarHeight * size_; ++row)
        image_.at(left_ + x * size_ + column, top_ + y * size_ + row).color = color;
    }
  }

 private:
  void glyph(std::uint32_t x, std::uint32_t y, char character) {
    const auto* const found =
        std::find_if(kFont.begin(), kFont.end(), [&](const Glyph& glyph) { return glyph.character == character; });
    if (found == kFont.end()) return;
    for (std::uint32_t row = 0; row < kGlyphHeight; ++row)
      for (std::uint32_t column = 0; column < kGlyphWidth; ++column)
        if (found->rows[row][column] != ' ') fill(x + column, y + row, 1, 1, kInk);
  }

  Image& image_;
  std::uint32_t left_, top_, size_;
};

}  // namespace

std::optional<LegendArea> draw_legend(Image& image, const LegendScale& scale) {
  const std::uint32_t room_x = image.width / (kPanelWidth + 2 * kMargin);
  const std::uint32_t columns = scale.histogram.empty() ? 0 : kHistogramHeight;
  const std::uint32_t panel = kPanelHeight + columns;
  const std::uint32_t room_y = image.height / (panel + 2 * kMargin);
  if (room_x == 0 || room_y == 0) return std::nullopt;
  const std::uint32_t size = std::min({room_x, room_y, std::max(1u, std::min(image.width / 400, image.height / 300))});
  const std::uint32_t left = kMargin * size, top = image.height - (kMargin + panel) * size;
  const std::uint32_t bar_top = kPadding + kGlyphHeight + kGap + columns, bar_end = bar_top + kBarHeight;
  Canvas canvas(image, left, top, size);
  canvas.darken(kPanelWidth, panel);
  canvas.text(kSide, kPadding, scale.title);
  if (!scale.histogram.empty()) canvas.histogram(kSide, bar_top - kGap, scale.histogram);
  canvas.bar(kSide, bar_top);
  for (unsigned tick = 0; tick <= 4; ++tick) {
    const std::string number = std::to_string(scale.top / 4 * tick);
    const std::uint32_t x = kSide + (kBarWidth - 1) * tick / 4;
    canvas.fill(x, bar_end, 1, kTick, kInk);
    const bool plus = tick == 4 && scale.clipped;
    canvas.text(x - std::min(x, text_width(number) / 2), bar_end + kGap, plus ? number + "+" : number);
  }
  return LegendArea{left,
                    top,
                    left + kPanelWidth * size,
                    top + panel * size,
                    left + kSide * size,
                    top + bar_top * size,
                    left + (kSide + kBarWidth) * size,
                    top + bar_end * size};
}

}  // namespace hiprt::tools
