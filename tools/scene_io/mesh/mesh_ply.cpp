/// PLY, ASCII and binary. Written here because assimp repeats the last line of a truncated file, or reads past it,
/// without an error, and rounds ASCII numbers only nearly right.

#include <tools/base/interrupt.h>
#include <tools/base/text.h>
#include <tools/scene_io/mesh/mesh_formats.h>
#include <tools/scene_io/mesh/ply_header.h>
#include <tools/scene_io/mesh/polygons.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace hiprt::tools {
namespace {

/// Values as words, in any arrangement of lines.
class AsciiSource {
 public:
  AsciiSource(std::string_view text, std::uint64_t lines) : text_(text), line_(lines + 1) {}

  static std::uint64_t least_bytes(PlyType) { return 2; }
  std::uint64_t bytes_left() const { return text_.size() + 1; }
  std::string location() const { return "line " + std::to_string(line_); }

  std::optional<double> read(PlyType type) {
    const std::string_view word = next_word_of_lines(text_, line_);
    // float32 is rounded once, from the text.
    if (type != PlyType::kFloat32) return parse_real<double>(word);
    const auto value = parse_real<float>(word);
    return value ? std::optional<double>(*value) : std::nullopt;
  }

 private:
  std::string_view text_;
  std::uint64_t line_;
};

class BinarySource {
 public:
  BinarySource(std::string_view data, std::size_t offset, bool swap) : data_(data), start_(offset), swap_(swap) {}

  static std::uint64_t least_bytes(PlyType type) { return size_of(type); }
  std::uint64_t bytes_left() const { return data_.size() - at_; }
  std::string location() const { return "byte " + std::to_string(start_ + at_); }

  std::optional<double> read(PlyType type) {
    const unsigned size = size_of(type);
    if (bytes_left() < size) return std::nullopt;
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), data_.data() + at_, size);
    if (swap_) std::reverse(raw.begin(), raw.begin() + size);
    at_ += size;
    switch (type) {
      case PlyType::kInt8:
        return as<std::int8_t>(raw);
      case PlyType::kUint8:
        return as<std::uint8_t>(raw);
      case PlyType::kInt16:
        return as<std::int16_t>(raw);
      case PlyType::kUint16:
        return as<std::uint16_t>(raw);
      case PlyType::kInt32:
        return as<std::int32_t>(raw);
      case PlyType::kUint32:
        return as<std::uint32_t>(raw);
      case PlyType::kFloat32:
        return as<float>(raw);
      case PlyType::kFloat64:
        break;
    }
    return as<double>(raw);
  }

 private:
  static_assert(std::endian::native == std::endian::little, "swap_ means the file is big-endian");

  template <class T> static double as(const std::array<char, 8>& raw) {
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return static_cast<double>(value);
  }

  std::string_view data_;
  std::size_t start_, at_ = 0;
  bool swap_;
};

template <class Source> class PlyReader {
 public:
  explicit PlyReader(Source source) : source_(source) {}

  build::Result<Mesh> read(const PlyHeader& header) {
    for (const PlyElement& element : header.elements) {
      if (element.properties.empty()) continue;
      if (auto done = check_count(element); !done) return tl::unexpected(done.error());
      const auto done = element.name == "vertex" ? read_vertices(element)
                        : element.name == "face" ? read_faces(element)
                                                 : skip(element);
      if (!done) return tl::unexpected(done.error());
    }
    auto triangles = triangulate(mesh_.positions, faces_, mesh_.skipped_faces);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh_.triangles = std::move(*triangles);
    return std::move(mesh_);
  }

 private:
  tl::unexpected<build::Error> fail(const PlyElement& element, std::uint64_t i, const std::string& what) const {
    return invalid_input(element.name + " " + std::to_string(i) + " of " + std::to_string(element.count) + ": " + what +
                         " at " + source_.location());
  }

  /// Refuses counts that the rest of the file cannot hold, before memory is asked for.
  build::Result<void> check_count(const PlyElement& element) const {
    std::uint64_t least = 0;  // The header has been refused if an element has no properties.
    for (const PlyProperty& p : element.properties) least += Source::least_bytes(p.is_list ? p.count_type : p.type);
    if (element.count <= source_.bytes_left() / std::max<std::uint64_t>(least, 1)) return {};
    return invalid_input("truncated: the header says " + std::to_string(element.count) + " elements '" + element.name +
                         "' of at least " + std::to_string(least) + " bytes each, but only " +
                         std::to_string(source_.bytes_left()) + " bytes are left");
  }

  build::Result<double> value(const PlyElement& element, std::uint64_t i, PlyType type) {
    if (const auto number = source_.read(type)) return *number;
    return fail(element, i, "truncated, or not a number,");
  }

  /// Calls take(property number, value) for every value of element number @p i; lists give their values in turn.
  template <class Take, class Length>
  build::Result<void> read_record(const PlyElement& element, std::uint64_t i, Take&& take, Length&& length) {
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const PlyProperty& property = element.properties[p];
      std::uint64_t count = 1;
      if (property.is_list) {
        const auto size = value(element, i, property.count_type);
        if (!size) return tl::unexpected(size.error());
        if (!(*size >= 0 && *size <= std::numeric_limits<std::uint32_t>::max() && *size == std::floor(*size)))
          return fail(element, i, "a list cannot have " + std::to_string(*size) + " values,");
        count = static_cast<std::uint64_t>(*size);
        length(p, static_cast<std::uint32_t>(count));
      }
      for (std::uint64_t k = 0; k < count; ++k) {
        if (interrupted_at(++values_)) return cancelled();
        const auto number = value(element, i, property.type);
        if (!number) return tl::unexpected(number.error());
        if (!take(p, *number)) return fail(element, i, "vertex number " + std::to_string(*number) + " is none,");
      }
    }
    return {};
  }

  build::Result<void> skip(const PlyElement& element) {
    for (std::uint64_t i = 0; i < element.count; ++i)
      if (auto done = read_record(
              element, i, [](std::size_t, double) { return true; }, [](std::size_t, std::uint32_t) {});
          !done)
        return done;
    return {};
  }

  build::Result<void> read_vertices(const PlyElement& element) {
    std::vector<std::size_t> axis(element.properties.size(), 3);
    unsigned found = 0;
    for (std::size_t p = 0; p < axis.size(); ++p)
      for (std::size_t a = 0; a < 3; ++a)
        if (!element.properties[p].is_list && element.properties[p].name == std::string_view("xyz").substr(a, 1)) {
          axis[p] = a;
          found |= 1u << a;
        }
    if (found != 7) return invalid_input("element 'vertex' lacks one of the properties x, y and z");
    if (element.count > std::numeric_limits<std::uint32_t>::max())
      return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "more than 4294967295 vertices"});
    mesh_.positions.resize(element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const auto take = [&](std::size_t p, double number) {
        if (axis[p] < 3) mesh_.positions[i][axis[p]] = static_cast<float>(number);
        return true;
      };
      if (auto done = read_record(element, i, take, [](std::size_t, std::uint32_t) {}); !done) return done;
    }
    return {};
  }

  build::Result<void> read_faces(const PlyElement& element) {
    const auto is_corners = [](const PlyProperty& p) {
      return p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    const auto list = std::find_if(element.properties.begin(), element.properties.end(), is_corners);
    if (list == element.properties.end())
      return invalid_input("element 'face' has no list property 'vertex_indices' or 'vertex_index'");
    const auto corners = static_cast<std::size_t>(list - element.properties.begin());
    faces_.sizes.reserve(element.count);
    faces_.corners.reserve(3 * element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const auto take = [&](std::size_t p, double number) {
        if (p != corners) return true;
        if (!(number >= 0 && number < 4294967296.0 && number == std::floor(number))) return false;
        faces_.corners.push_back(static_cast<std::uint32_t>(number));
        return true;
      };
      const auto length = [&](std::size_t p, std::uint32_t count) {
        if (p == corners) faces_.sizes.push_back(count);
      };
      if (auto done = read_record(element, i, take, length); !done) return done;
    }
    return {};
  }

  Source source_;
  std::uint64_t values_ = 0;  ///< Read so far.
  Mesh mesh_;
  Polygons faces_;
};

}  // namespace

build::Result<Mesh> read_ply(std::span<const std::byte> bytes) {
  std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  skip_byte_order_mark(text);
  const auto header = parse_ply_header(text);
  if (!header) return tl::unexpected(header.error());
  for (const char* name : {"vertex", "face"})
    if (std::none_of(header->elements.begin(), header->elements.end(), [&](const auto& e) { return e.name == name; }))
      return invalid_input(std::string("the header names no element '") + name + "'");
  if (header->encoding == PlyEncoding::kAscii) return PlyReader(AsciiSource(text, header->lines)).read(*header);
  return PlyReader(BinarySource(text, bytes.size() - text.size(), header->encoding == PlyEncoding::kBigEndian))
      .read(*header);
}

}  // namespace hiprt::tools
