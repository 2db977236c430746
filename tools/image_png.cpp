#include "color.h"
#include "image.h"

#include <hiprt_build/file.h>

#include <png.h>

#include <algorithm>
#include <span>

namespace hiprt::tools {
namespace {

std::vector<unsigned char> to_bytes(const Image& image) {
  float white = 1.0f;
  for (const Pixel& pixel : image.pixels) white = std::max(white, luminance(pixel.color));
  std::vector<unsigned char> bytes;
  bytes.reserve(image.pixels.size() * 3);
  for (const Pixel& pixel : image.pixels) {
    const Vec3 color = reinhard(pixel.color, white);
    for (int channel = 0; channel < 3; ++channel) bytes.push_back(srgb_byte(color[channel]));
  }
  return bytes;
}

}  // namespace

build::Result<std::size_t> write_png(const std::filesystem::path& path, const Image& image) {
  const std::vector<unsigned char> pixels = to_bytes(image);
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  png.width = image.width;
  png.height = image.height;
  png.format = PNG_FORMAT_RGB;
  std::vector<unsigned char> file(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t size = file.size();
  if (png_image_write_to_memory(&png, file.data(), &size, 0, pixels.data(), 0, nullptr) == 0)
    return tl::unexpected(build::Error{build::ErrorCode::kIo, "cannot encode '" + path.string() + "': " + png.message});
  const auto bytes = std::as_bytes(std::span(file.data(), size));
  if (auto written = build::write_file(path, bytes); !written) return tl::unexpected(written.error());
  return bytes.size();
}

}  // namespace hiprt::tools
