#pragma once
/// A perceptually uniform colour map.

#include <tools/render/image/color.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace hiprt::tools {

/// Viridis by Smith, van der Walt and Firing (matplotlib, CC0): 17 points of its table of 256 with linear
/// interpolation, within 0.023 of the table.
/// @param t clamped to [0, 1]: dark violet to yellow.
/// @return linear light.
inline Vec3 viridis(float t) {
  static constexpr std::size_t kLast = 16;
  static constexpr std::array<std::array<float, 3>, kLast + 1> kTable{{{0.2670f, 0.0049f, 0.3294f},
                                                                       {0.2823f, 0.0946f, 0.4170f},
                                                                       {0.2789f, 0.1749f, 0.4830f},
                                                                       {0.2593f, 0.2507f, 0.5244f},
                                                                       {0.2302f, 0.3213f, 0.5455f},
                                                                       {0.2000f, 0.3864f, 0.5545f},
                                                                       {0.1733f, 0.4474f, 0.5579f},
                                                                       {0.1497f, 0.5064f, 0.5573f},
                                                                       {0.1281f, 0.5651f, 0.5509f},
                                                                       {0.1203f, 0.6238f, 0.5343f},
                                                                       {0.1554f, 0.6815f, 0.5032f},
                                                                       {0.2415f, 0.7366f, 0.4545f},
                                                                       {0.3629f, 0.7867f, 0.3866f},
                                                                       {0.5081f, 0.8292f, 0.2992f},
                                                                       {0.6694f, 0.8622f, 0.1954f},
                                                                       {0.8359f, 0.8861f, 0.1025f},
                                                                       {0.9932f, 0.9062f, 0.1439f}}};
  const float position = std::clamp(t, 0.0f, 1.0f) * static_cast<float>(kLast);
  const std::size_t i = std::min(static_cast<std::size_t>(position), kLast - 1);
  const float f = position - static_cast<float>(i);
  const auto entry = [](std::size_t k) { return Vec3(kTable[k][0], kTable[k][1], kTable[k][2]); };
  return linear_from_srgb(entry(i) * (1.0f - f) + entry(i + 1) * f);
}

}  // namespace hiprt::tools
