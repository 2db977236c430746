#include <tools/render/studio/heatmap.h>

#include <tools/render/image/color_map.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace hiprt::tools {
namespace {

/// The smallest round multiple of 4 that is not below @p value: all quarters are integers.
unsigned round_top(float value) {
  constexpr std::array<unsigned, 3> kSmall{4, 8, 12};
  constexpr std::array<unsigned, 9> kDecade{16, 20, 24, 32, 40, 60, 80, 100, 120};
  for (const unsigned step : kSmall)
    if (static_cast<float>(step) >= value) return step;
  constexpr unsigned kLastScale = 10'000'000;
  for (unsigned scale = 1; scale <= kLastScale; scale *= 10)
    for (const unsigned step : kDecade)
      if (static_cast<float>(step * scale) >= value) return step * scale;
  return kDecade.back() * kLastScale;
}

}  // namespace

HeatRange heat_range(std::span<const float> cost) {
  if (cost.empty()) return {4, false};
  std::vector<float> sorted(cost.begin(), cost.end());
  const std::size_t rank = (sorted.size() - 1) * 995 / 1000;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(rank), sorted.end());
  const unsigned top = round_top(sorted[rank]);
  const float largest = *std::max_element(sorted.begin() + static_cast<std::ptrdiff_t>(rank), sorted.end());
  return {top, largest > static_cast<float>(top)};
}

void apply_heatmap(Image& image, std::span<const float> cost) {
  const HeatRange range = heat_range(cost);
  std::array<std::uint64_t, kLegendParts> histogram{};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float part = cost[i] / static_cast<float>(range.top);
    image.pixels[i].color = viridis(part);
    ++histogram[std::min(static_cast<std::size_t>(part * static_cast<float>(kLegendParts)), kLegendParts - 1)];
  }
  const char* title = image.has_instances ? "tests + instances per ray" : "box + leaf tests per ray";
  draw_legend(image, {title, range.top, range.clipped, histogram});
}

}  // namespace hiprt::tools
