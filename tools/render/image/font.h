#pragma once
/// The font that is compiled into the tools.

#include <cstddef>
#include <span>

namespace hiprt::tools {

/// DejaVu Sans as a TrueType file (DejaVu.LICENSE).
std::span<const std::byte> font_file();

}  // namespace hiprt::tools
