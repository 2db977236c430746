#include <tools/scene_io/surface/picture.h>

#include <tools/base/errors.h>

#include <string>
#include <string_view>

namespace hiprt::tools {

build::Result<void> check_picture_size(std::uint32_t width, std::uint32_t height, std::uint64_t most_texels) {
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " texels";
  if (width == 0 || height == 0) return invalid_input(size);
  const auto too_large = [&](const std::string& limit) {
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, size + ", " + limit});
  };
  if (width > kMostPictureSide || height > kMostPictureSide)
    return too_large("the limit is " + std::to_string(kMostPictureSide) + " a side");
  if (std::uint64_t{width} * height > most_texels)
    return too_large("and only " + std::to_string(most_texels) + " are left of the limit for all pictures");
  return {};
}

build::Result<void> check_file_size(std::uint32_t width, std::uint32_t height, std::uint64_t bits,
                                    std::uint64_t expansion, std::uint64_t file_bytes) {
  const std::uint64_t least = std::uint64_t{width} * height * bits / 8 / expansion;
  if (least <= file_bytes) return {};
  return invalid_input("truncated: " + std::to_string(width) + " x " + std::to_string(height) + " texels take " +
                       std::to_string(least) + " bytes or more, but the file has " + std::to_string(file_bytes));
}

build::Result<Texture> decode_picture(std::span<const std::byte> bytes, std::uint64_t most_texels) {
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  if (text.starts_with("\x89PNG\r\n\x1a\n")) return decode_png(bytes, most_texels);
  if (text.starts_with("\xff\xd8\xff")) return decode_jpeg(bytes, most_texels);
  return invalid_input("it is neither PNG nor JPEG");
}

}  // namespace hiprt::tools
