#include <tools/render/image/font.h>

// HIPRT_FONT_FILE is the path of DejaVuSans.ttf (tools/CMakeLists.txt).
asm(R"(
  .section .rodata
  .balign 16
  .globl hiprt_font_begin
  .globl hiprt_font_end
  .hidden hiprt_font_begin
  .hidden hiprt_font_end
hiprt_font_begin:
  .incbin ")" HIPRT_FONT_FILE R"("
hiprt_font_end:
  .previous
)");

extern "C" {
extern const std::byte hiprt_font_begin[];
extern const std::byte hiprt_font_end[];
}

namespace hiprt::tools {

std::span<const std::byte> font_file() { return {hiprt_font_begin, hiprt_font_end}; }

}  // namespace hiprt::tools
