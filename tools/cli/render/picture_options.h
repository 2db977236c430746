#pragma once
/// Names and sizes of pictures on command lines.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hiprt::tools {

struct PictureSize {
  std::uint32_t width, height;
};

/// "800x600"; nothing when it is malformed or too large.
std::optional<PictureSize> parse_size(std::string_view text);

/// Whether the name of a picture ends in .exr, in any case.
bool is_exr(const std::string& path);

// CLI11 validators return an empty string, or what is wrong.

std::string check_size(const std::string& text);
/// Whether a name ends in .exr or .png.
std::string check_picture_name(const std::string& path);

}  // namespace hiprt::tools
