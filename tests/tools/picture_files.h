#pragma once
/// PNG and JPEG files in memory, by the libraries' own writers.

#include <png.h>
#include <tiny_gltf.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace hiprt::test {

/// The content of a PNG file.
struct PngContent {
  std::uint32_t width, height;
  int color_type = PNG_COLOR_TYPE_RGBA;
  int depth = 8;
  std::vector<unsigned char> rows{};  ///< As in the file: packed bits, 16 bits with the high byte first.
  bool interlaced = false;
  std::vector<png_color> palette{};
  std::vector<unsigned char> transparent{};  ///< Alpha of the palette's first colours.
  int transparent_grey = -1;                 ///< The grey that is transparent; -1: none is.
  double gamma = 0;                          ///< 0: the file does not say.
};

inline std::string png_file(PngContent content) {
  std::string file;
  const auto on_bytes = [](png_structp png, png_bytep bytes, std::size_t size) {
    static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), size);
  };
  const auto on_error = [](png_structp, png_const_charp message) { throw std::runtime_error(message); };
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &file, on_bytes, nullptr);
  png_set_IHDR(png, info, content.width, content.height, content.depth, content.color_type,
               content.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  if (!content.palette.empty())
    png_set_PLTE(png, info, content.palette.data(), static_cast<int>(content.palette.size()));
  png_color_16 grey{};
  grey.gray = static_cast<png_uint_16>(content.transparent_grey);
  if (!content.transparent.empty())
    png_set_tRNS(png, info, content.transparent.data(), static_cast<int>(content.transparent.size()), nullptr);
  if (content.transparent_grey >= 0) png_set_tRNS(png, info, nullptr, 0, &grey);
  if (content.gamma != 0) png_set_gAMA(png, info, content.gamma);
  png_write_info(png, info);
  const std::size_t stride = content.rows.size() / content.height;
  std::vector<png_bytep> rows;
  rows.reserve(content.height);
  for (std::uint32_t y = 0; y < content.height; ++y) rows.push_back(content.rows.data() + y * stride);
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return file;
}

/// Of bytes red, green, blue, alpha for each texel.
inline std::string png_file(std::uint32_t width, std::uint32_t height, std::vector<unsigned char> rgba) {
  return png_file(PngContent{.width = width, .height = height, .rows = std::move(rgba)});
}

/// A texel as Texture has it.
inline std::uint32_t texel(unsigned red, unsigned green, unsigned blue, unsigned alpha = 255) {
  return red | green << 8 | blue << 16 | alpha << 24;
}

/// tinygltf::WriteImageData() into a data URI. In version 2.9 it has two more parameters than in 2.5.
template <class Image> bool write_jpeg(Image& image, std::string& uri) {
  const std::string name = "a.jpg", folder;
  constexpr auto kWrite = &tinygltf::WriteImageData;
  if constexpr (requires { kWrite(&folder, &name, &image, true, &uri, nullptr); })
    return kWrite(&folder, &name, &image, true, &uri, nullptr);
  else
    return kWrite(&folder, &name, &image, true, nullptr, nullptr, &uri, nullptr);
}

/// A baseline JPEG file of best quality, of bytes red, green, blue.
inline std::string jpeg_file(int width, int height, const std::vector<unsigned char>& rgb) {
  tinygltf::Image image;
  image.width = width;
  image.height = height;
  image.component = 3;
  image.bits = 8;
  image.pixel_type = TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
  image.image = rgb;
  std::string uri, mime;
  if (!write_jpeg(image, uri)) throw std::runtime_error("no JPEG was written");
  std::vector<unsigned char> bytes;
  tinygltf::DecodeDataURI(&bytes, mime, uri, 0, false);
  return {bytes.begin(), bytes.end()};
}

}  // namespace hiprt::test
