#pragma once
/// The error message of libpng, which reports errors by longjmp().

#include <png.h>

#include <array>
#include <cstdio>

namespace hiprt::tools {

/// The error_ptr of a png_struct whose error function is PngMessage::on_error.
class PngMessage {
 public:
  const char* text() const { return text_.data(); }

  static void on_error(png_structp png, png_const_charp message) {
    // The text may be on the stack that the jump leaves: copy it.
    auto& to = static_cast<PngMessage*>(png_get_error_ptr(png))->text_;
    std::snprintf(to.data(), to.size(), "%s", message);
    png_longjmp(png, 1);
  }
  static void on_warning(png_structp, png_const_charp) {}

 private:
  std::array<char, 128> text_{"libpng does not start"};
};

}  // namespace hiprt::tools
