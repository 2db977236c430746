#pragma once
/// When a picture is taken.

#include <optional>
#include <string>

namespace hiprt::tools {

struct Shutter {
  float open = 0.0f, close = 0.0f;
};

/// "0,0.5"; nothing when it is malformed, not finite or closes before it opens.
std::optional<Shutter> parse_shutter(const std::string& text);

/// A CLI11 validator: an empty string, or what is wrong.
std::string check_shutter(const std::string& text);

}  // namespace hiprt::tools
