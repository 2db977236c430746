#include <tools/render/studio/legend.h>

#include <tools/render/image/color_map.h>
#include <tools/render/image/text_picture.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace hiprt::tools {
namespace {

/// Height of a line of text in cells: room for tall letters and for the tails of p and y.
constexpr std::uint32_t kTextHeight = 8;
/// Font size in pixels for cells of @p size pixels: digits are 7 cells high.
constexpr unsigned font_size(std::uint32_t size) { return 9 * size; }

// The panel's layout in cells.
constexpr std::uint32_t kPadding = 4, kBarHeight = 10, kBarWidth = 160, kGap = 3, kTick = 2, kColumns = 20;
/// Room for half of the numbers below both ends of the bar.
constexpr std::uint32_t kSide = 16;
constexpr std::uint32_t kPanelWidth = kBarWidth + 2 * kSide;
constexpr std::uint32_t kPanelHeight = 2 * kPadding + 2 * kTextHeight + 2 * kGap + kBarHeight;
/// With a histogram: its columns, and a gap.
constexpr std::uint32_t kHistogramHeight = kColumns + kGap;
static_assert(kBarWidth % kLegendParts == 0);
constexpr std::uint32_t kMargin = 4;

constexpr Vec3 kInk{0.9f};

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
  /// Text whose left edge is at cell @p x.
  void text(std::uint32_t x, std::uint32_t y, std::string_view text) {
    draw(draw_text(text, font_size(size_)), x * size_, y * size_);
  }
  /// A number whose middle is at cell @p x, and a plus after it.
  void number(std::uint32_t x, std::uint32_t y, unsigned value, bool plus) {
    const TextPicture digits = draw_text(std::to_string(value), font_size(size_));
    const std::uint32_t left = x * size_ - std::min(x * size_, digits.width / 2);
    draw(digits, left, y * size_);
    if (plus) draw(draw_text("+", font_size(size_)), left + digits.width, y * size_);
  }
  /// One column per count. Heights are proportional to square roots, rounded up: small counts stay visible.
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
  /// Blends ink into the picture. @param left, top in pixels from the panel's corner. Text ends at the panel's edge.
  void draw(const TextPicture& text, std::uint32_t left, std::uint32_t top) {
    const std::uint32_t width = std::min(text.width, kPanelWidth * size_ - std::min(kPanelWidth * size_, left));
    for (std::uint32_t row = 0; row < text.height; ++row)
      for (std::uint32_t column = 0; column < width; ++column) {
        const float coverage = text.coverage[std::size_t{row} * text.width + column];
        Vec3& color = image_.at(left_ + left + column, top_ + top + row).color;
        color = color * (1.0f - coverage) + kInk * coverage;
      }
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
  const std::uint32_t bar_top = kPadding + kTextHeight + kGap + columns, bar_end = bar_top + kBarHeight;
  Canvas canvas(image, left, top, size);
  canvas.darken(kPanelWidth, panel);
  canvas.text(kSide, kPadding, scale.title);
  if (!scale.histogram.empty()) canvas.histogram(kSide, bar_top - kGap, scale.histogram);
  canvas.bar(kSide, bar_top);
  for (unsigned tick = 0; tick <= 4; ++tick) {
    const std::uint32_t x = kSide + (kBarWidth - 1) * tick / 4;
    canvas.fill(x, bar_end, 1, kTick, kInk);
    canvas.number(x, bar_end + kGap, scale.top / 4 * tick, tick == 4 && scale.clipped);
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
