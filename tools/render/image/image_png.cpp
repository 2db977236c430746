#include <tools/render/image/color.h>
#include <tools/render/image/image.h>
#include <tools/render/image/image_write.h>
#include <tools/scene_io/surface/png_message.h>

#include <hiprt_build/file.h>

#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <memory>
#include <span>

namespace hiprt::tools {
namespace {

/// A PNG file in memory, row by row. libpng reports errors by longjmp(), over frames without destructors only.
class PngEncoder {
 public:
  PngEncoder()
      : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, &message_, PngMessage::on_error, PngMessage::on_warning)) {
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  PngEncoder(const PngEncoder&) = delete;
  PngEncoder& operator=(const PngEncoder&) = delete;
  ~PngEncoder() { png_destroy_write_struct(&png_, &info_); }

  bool begin(std::uint32_t width, std::uint32_t height) {
    if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_write_fn(png_, &file_, on_bytes, nullptr);
    png_set_IHDR(png_, info_, width, height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png_, info_, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png_, info_);
    return true;
  }
  bool row(const unsigned char* bytes) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_write_row(png_, bytes);
    return true;
  }
  bool end() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_write_end(png_, info_);
    return true;
  }

  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(file_)); }
  const char* message() const { return message_.text(); }

 private:
  static void on_bytes(png_structp png, png_bytep bytes, std::size_t size) {
    if (!append(*static_cast<std::vector<unsigned char>*>(png_get_io_ptr(png)), bytes, size))
      png_error(png, "not enough memory");
  }
  static bool append(std::vector<unsigned char>& file, const unsigned char* bytes, std::size_t size) try {
    file.insert(file.end(), bytes, bytes + size);
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }

  PngMessage message_;
  std::vector<unsigned char> file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

float brightest(const Image& image) {
  float white = 1.0f;
  for (const Pixel& pixel : image.pixels) white = std::max(white, luminance(pixel.color));
  return white;
}

}  // namespace

build::Result<std::size_t> write_png(const std::filesystem::path& path, const Image& image,
                                     const EncodeProgress& progress) {
  const float white = brightest(image);
  std::vector<unsigned char> row(std::size_t{image.width} * 3);
  PngEncoder png;
  bool encoded = png.begin(image.width, image.height);
  for (std::uint32_t y = 0; encoded && y < image.height; ++y) {
    if (progress && !progress(static_cast<double>(y) / image.height))
      return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled"});
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const Vec3 color = reinhard(image.at(x, y).color, white);
      for (int channel = 0; channel < 3; ++channel)
        row[std::size_t{x} * 3 + static_cast<std::size_t>(channel)] = srgb_byte(color[channel]);
    }
    encoded = png.row(row.data());
  }
  if (!encoded || !png.end())
    return tl::unexpected(
        build::Error{build::ErrorCode::kIo, "cannot encode '" + path.string() + "': " + png.message()});
  if (auto written = build::write_file(path, png.bytes()); !written) return tl::unexpected(written.error());
  return png.bytes().size();
}

}  // namespace hiprt::tools
