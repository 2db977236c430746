#include <tools/scene_io/shapes/shape_import.h>

#include <tools/base/memory_limit.h>
#include <tools/base/read_input.h>
#include <tools/base/text.h>
#include <tools/scene_io/shapes/shape_formats.h>

#include <array>
#include <cctype>
#include <cstdio>
#include <new>

namespace hiprt::tools {
namespace {

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

/// A number and no sign of more on the line.
build::Result<ShapePoint> parse_sphere(std::string_view line) {
  ShapePoint point{};
  unsigned numbers = 0;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line), ++numbers) {
    const auto value = parse_real<float>(word);
    if (!value) return invalid_input(in_quotes(word) + " is not a number");
    if (numbers < 3) point.position[numbers] = *value;
    if (numbers == 3) point.radius = *value;
  }
  if (numbers != 4) return invalid_input(std::to_string(numbers) + " numbers, 4 expected");
  if (const std::string fault = shape_point_fault(point); !fault.empty()) return invalid_input(fault);
  return point;
}

}  // namespace

std::string shape_point_fault(const ShapePoint& point) {
  const auto text = [](float value) {
    std::array<char, 32> digits{};
    std::snprintf(digits.data(), digits.size(), "%.9g", static_cast<double>(value));
    return std::string(digits.data());
  };
  for (unsigned axis = 0; axis < 3; ++axis)
    if (!shape_detail::is_finite(point.position[axis]))
      return std::string(1, "xyz"[axis]) + " is " + text(point.position[axis]);
  return shape_detail::is_valid(point) ? "" : "radius " + text(point.radius);
}

build::Result<ShapeSet> read_xyzr(std::span<const std::byte> bytes) {
  std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  if (is_utf16(text)) return invalid_input(kUtf16Fault);
  skip_byte_order_mark(text);
  ShapeSet shapes;
  shapes.kind = ShapeKind::kSpheres;
  for (std::uint64_t line = 1; !text.empty(); ++line) {
    if (interrupted_at(line)) return cancelled();
    std::string_view content = next_line(text);
    content = without_comment(content);
    std::string_view rest = content;
    if (next_word(rest).empty()) continue;
    const auto point = parse_sphere(content);
    if (!point) return invalid_input("line " + std::to_string(line) + ": " + point.error().message);
    shapes.points.push_back(*point);
  }
  return shapes;
}

bool is_shape_file(const std::string& path) {
  const std::string extension = lower_extension(path);
  return extension == ".hair" || extension == ".xyzr";
}

build::Result<ShapeSet> load_shapes(const std::filesystem::path& path) {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  try {
    auto shapes = lower_extension(path) == ".hair" ? read_hair(file->bytes()) : read_xyzr(file->bytes());
    if (!shapes)
      return tl::unexpected(build::Error{shapes.error().code, path.string() + ": " + shapes.error().message});
    shapes->name = path.filename().string();
    shapes->path = path.string();
    return shapes;
  } catch (const std::bad_alloc& failure) {
    return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
  }
}

}  // namespace hiprt::tools
