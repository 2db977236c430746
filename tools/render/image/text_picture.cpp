#include <tools/render/image/text_picture.h>

#include <tools/render/image/font.h>

#include <freetype/freetype.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

namespace hiprt::tools {
namespace {

struct FreeLibrary {
  void operator()(FT_Library library) const { FT_Done_FreeType(library); }
};
struct FreeFace {
  void operator()(FT_Face face) const { FT_Done_Face(face); }
};
using Library = std::unique_ptr<FT_LibraryRec_, FreeLibrary>;
using Face = std::unique_ptr<FT_FaceRec_, FreeFace>;

void check(FT_Error error) {
  if (error != 0) throw std::runtime_error("FreeType: error " + std::to_string(error));
}

Library open_library() {
  FT_Library library = nullptr;
  check(FT_Init_FreeType(&library));
  return Library(library);
}

Face open_face(const Library& library, unsigned em) {
  const auto file = font_file();
  FT_Face face = nullptr;
  check(FT_New_Memory_Face(library.get(), reinterpret_cast<const FT_Byte*>(file.data()),
                           static_cast<FT_Long>(file.size()), 0, &face));
  Face result(face);
  check(FT_Set_Pixel_Sizes(face, 0, em));
  return result;
}

/// A pixel of a glyph, 0 to 1.
float coverage_at(const FT_Bitmap& bitmap, unsigned x, unsigned y) {
  const unsigned char* const row = bitmap.buffer + static_cast<std::ptrdiff_t>(y) * bitmap.pitch;
  if (bitmap.pixel_mode == FT_PIXEL_MODE_MONO) return (row[x / 8] >> (7 - x % 8) & 1) != 0 ? 1.0f : 0.0f;
  return static_cast<float>(row[x]) / 255.0f;
}

/// Adds a glyph whose bitmap begins at column @p left and row @p top of the picture.
void add_glyph(TextPicture& picture, const FT_Bitmap& bitmap, int left, int top) {
  for (unsigned y = 0; y < bitmap.rows; ++y)
    for (unsigned x = 0; x < bitmap.width; ++x) {
      const int column = left + static_cast<int>(x), row = top + static_cast<int>(y);
      if (column < 0 || row < 0 || column >= static_cast<int>(picture.width) || row >= static_cast<int>(picture.height))
        continue;
      float& pixel = picture.coverage[static_cast<std::size_t>(row) * picture.width + static_cast<std::size_t>(column)];
      pixel = std::max(pixel, coverage_at(bitmap, x, y));
    }
}

}  // namespace

TextPicture draw_text(std::string_view text, unsigned em) {
  const Library library = open_library();
  const Face face = open_face(library, em);
  const bool small = em < kSmallText;
  const FT_Int32 flags = FT_LOAD_RENDER | (small ? FT_LOAD_TARGET_MONO : FT_LOAD_NO_HINTING);
  const auto each_glyph = [&](const auto& use) {
    for (const char character : text) {
      const FT_UInt index = FT_Get_Char_Index(face.get(), static_cast<unsigned char>(character));
      if (index == 0) continue;
      check(FT_Load_Glyph(face.get(), index, flags));
      use(*face->glyph);
    }
  };
  FT_Pos width = 0;
  each_glyph([&](const FT_GlyphSlotRec_& glyph) { width += glyph.advance.x; });
  // Above the baseline: capitals and digits (0.73 em) and b, d, f (0.76 em). Below it: p and y (0.21 em).
  const int ascent = static_cast<int>((76 * em + 99) / 100), descent = static_cast<int>((22 * em + 99) / 100);
  TextPicture picture{static_cast<std::uint32_t>((width + 63) / 64), static_cast<std::uint32_t>(ascent + descent), {}};
  picture.coverage.assign(std::size_t{picture.width} * picture.height, 0.0f);
  FT_Pos pen = 0;
  each_glyph([&](const FT_GlyphSlotRec_& glyph) {
    add_glyph(picture, glyph.bitmap, static_cast<int>(pen / 64) + glyph.bitmap_left, ascent - glyph.bitmap_top);
    pen += glyph.advance.x;
  });
  return picture;
}

}  // namespace hiprt::tools
