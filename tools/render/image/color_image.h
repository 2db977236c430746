#pragma once
/// A picture without other layers than colour.

#include <tools/render/image/image.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hiprt::tools {

/// Linear light, sRGB primaries.
struct ColorImage {
  ColorImage(std::uint32_t image_width, std::uint32_t image_height)
      : width(image_width), height(image_height), colors(std::size_t{image_width} * image_height) {}

  std::uint32_t width, height;
  std::vector<Vec3> colors;  ///< Row by row, the top row first.
};

/// The colours of a rendered picture.
inline ColorImage colors_of(const Image& image) {
  ColorImage result(image.width, image.height);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) result.colors[i] = image.pixels[i].color;
  return result;
}

}  // namespace hiprt::tools
