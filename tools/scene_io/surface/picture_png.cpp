#include <tools/base/errors.h>
#include <tools/scene_io/surface/picture.h>
#include <tools/scene_io/surface/png_message.h>

#include <png.h>

#include <array>
#include <csetjmp>
#include <cstring>
#include <string>

namespace hiprt::tools {
namespace {

/// Decodes a PNG file in memory. libpng reports errors by longjmp(), over frames without destructors only.
class PngDecoder {
 public:
  explicit PngDecoder(std::span<const std::byte> file)
      : rest_(file),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &message_, PngMessage::on_error, PngMessage::on_warning)) {
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;
  ~PngDecoder() { png_destroy_read_struct(&png_, &info_, nullptr); }

  /// Everything before the texels; sizes are valid afterwards.
  bool begin() {
    if (info_ == nullptr || setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, &rest_, on_read);
    // Larger ones are refused by check_picture_size(), whose message has the limit.
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_read_info(png_, info_);
    return true;
  }
  std::uint32_t width() const { return png_get_image_width(png_, info_); }
  std::uint32_t height() const { return png_get_image_height(png_, info_); }
  std::uint64_t bits() const { return std::uint64_t{png_get_bit_depth(png_, info_)} * png_get_channels(png_, info_); }

  /// @param texels width() * height() of them. @param rows height() pointers into them.
  bool read(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_expand(png_);
    png_set_scale_16(png_);
    png_set_gray_to_rgb(png_);
    png_set_add_alpha(png_, 0xff, PNG_FILLER_AFTER);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    if (png_get_rowbytes(png_, info_) != std::size_t{4} * width()) png_error(png_, "unknown kind of texels");
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  const char* message() const { return message_.text(); }

 private:
  static void on_read(png_structp png, png_bytep to, std::size_t size) {
    auto& rest = *static_cast<std::span<const std::byte>*>(png_get_io_ptr(png));
    if (size > rest.size()) png_error(png, "truncated");
    std::memcpy(to, rest.data(), size);
    rest = rest.subspan(size);
  }

  std::span<const std::byte> rest_;
  PngMessage message_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

build::Result<Texture> decode_png(std::span<const std::byte> bytes, std::uint64_t most_texels) {
  PngDecoder png(bytes);
  const auto damaged = [&] { return invalid_input(std::string("damaged PNG: ") + png.message()); };
  if (!png.begin()) return damaged();
  if (auto checked = check_picture_size(png.width(), png.height(), most_texels); !checked)
    return tl::unexpected(checked.error());
  constexpr std::uint64_t kDeflate = 1032;  // The longest match, 258 bytes, takes two bits.
  if (auto checked = check_file_size(png.width(), png.height(), png.bits(), kDeflate, bytes.size()); !checked)
    return tl::unexpected(checked.error());
  Texture result{{}, png.width(), png.height(), {}};
  result.texels.resize(std::size_t{result.width} * result.height);
  std::vector<png_bytep> rows(result.height);
  for (std::size_t y = 0; y < rows.size(); ++y)
    rows[y] = reinterpret_cast<png_bytep>(result.texels.data() + y * result.width);
  if (!png.read(rows.data())) return damaged();
  return result;
}

}  // namespace hiprt::tools
