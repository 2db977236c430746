#include <tools/render/scene/shutter.h>

#include <tools/base/text.h>

#include <cmath>

namespace hiprt::tools {

std::optional<Shutter> parse_shutter(const std::string& text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) return std::nullopt;
  const auto open = parse_real<float>(text.substr(0, comma)), close = parse_real<float>(text.substr(comma + 1));
  if (!open || !close || !std::isfinite(*open) || !std::isfinite(*close) || *open > *close) return std::nullopt;
  return Shutter{*open, *close};
}

std::string check_shutter(const std::string& text) {
  return parse_shutter(text) ? std::string() : in_quotes(text) + " is not OPEN,CLOSE, two times in order";
}

}  // namespace hiprt::tools
