#pragma once
/// Text as a picture, in DejaVu Sans. The font is part of the program, so that text does not depend on the machine.

#include <cstdint>
#include <string_view>
#include <vector>

namespace hiprt::tools {

/// One line of text.
struct TextPicture {
  std::uint32_t width, height;  ///< In pixels. The height depends on the font size only.
  std::vector<float> coverage;  ///< Of each pixel by ink, 0 to 1, row by row from the top.
};

/// Letters below this size are drawn without grey levels: thin strokes stay bright.
inline constexpr unsigned kSmallText = 14;

/// @param text ASCII. Characters that the font does not have are left out.
/// @param em font size in pixels, at least 4.
TextPicture draw_text(std::string_view text, unsigned em);

}  // namespace hiprt::tools
