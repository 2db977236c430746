#include <tools/cli/render/picture_options.h>

#include <tools/base/text.h>
#include <tools/render/image/image.h>

#include <cctype>
#include <charconv>
#include <filesystem>

namespace hiprt::tools {

std::optional<PictureSize> parse_size(std::string_view text) {
  PictureSize size{};
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  if (width.ec != std::errc() || width.ptr == end || *width.ptr != 'x') return std::nullopt;
  const auto height = std::from_chars(width.ptr + 1, end, size.height);
  if (height.ec != std::errc() || height.ptr != end) return std::nullopt;
  if (size.width < 1 || size.height < 1 || size.width > kMaxSide || size.height > kMaxSide) return std::nullopt;
  if (std::uint64_t{size.width} * size.height > kMaxPixels) return std::nullopt;
  return size;
}

bool is_exr(const std::string& path) { return has_extension(path, ".exr"); }

std::string check_size(const std::string& text) {
  if (parse_size(text)) return {};
  return "'" + text + "' is not WIDTHxHEIGHT, each 1 to 32768 and 134217728 pixels at most";
}

std::string check_picture_name(const std::string& path) {
  if (is_exr(path) || has_extension(path, ".png")) return {};
  return "'" + path + "' ends neither in .exr nor in .png";
}

}  // namespace hiprt::tools
