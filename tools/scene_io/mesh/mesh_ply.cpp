/// PLY, ASCII and binary. Written here because assimp repeats the last line of a truncated file, or reads past it,
/// without an error, and rounds ASCII numbers only nearly right.

#include <tools/base/interrupt.h>
#include <tools/base/text.h>
#include <tools/scene_io/ignored.h>
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
  std::string_view rest() const { return text_; }

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
  std::string_view rest() const { return data_.substr(at_); }

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
      case PlyType::kInt64:
        return as<std::int64_t>(raw);
      case PlyType::kUint64:
        return as<std::uint64_t>(raw);
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
  PlyReader(Source source, bool surfaces) : source_(source), surfaces_(surfaces) {}

  build::Result<Mesh> read(const PlyHeader& header) {
    for (const PlyElement& element : header.elements) {
      if (element.properties.empty()) continue;
      if (auto done = check_count(element); !done) return tl::unexpected(done.error());
      if (auto done = read_element(element); !done) return tl::unexpected(done.error());
    }
    auto triangles = triangulate(mesh_.positions, faces_, mesh_.skipped_faces);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh_.triangles = std::move(*triangles);
    warn(header);
    return std::move(mesh_);
  }

 private:
  build::Result<void> read_element(const PlyElement& element) {
    if (element.name == "vertex") return read_vertices(element);
    if (element.name == "face") return read_faces(element);
    if (element.name == "tristrips") return read_strips(element);
    ignored_.add("elements " + in_quotes(element.name), element.count);
    return skip(element);
  }

  void warn(const PlyHeader& header) {
    ignored_.add("header lines with unknown keywords", header.ignored_lines);
    std::string_view left = source_.rest();
    std::uint64_t line = 0;
    const std::string_view word = next_word_of_lines(left, line);
    ignored_.add("bytes behind the last element", word.size() + left.size());
    ignored_.warn(mesh_.warnings);
  }

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

  /// What a surface could have of the element: each kind once, by the usual names of a first component.
  void count_attributes(const PlyElement& element, const std::string& of) {
    constexpr std::array<std::pair<std::string_view, const char*>, 9> kNames{{{"red", "colours"},
                                                                              {"r", "colours"},
                                                                              {"diffuse_red", "colours"},
                                                                              {"nx", "normals"},
                                                                              {"u", "texture coordinates"},
                                                                              {"s", "texture coordinates"},
                                                                              {"texture_u", "texture coordinates"},
                                                                              {"texcoord", "texture coordinates"},
                                                                              {"material_index", "materials"}}};
    for (const PlyProperty& property : element.properties)
      for (const auto& [name, kind] : kNames)
        if (property.name == name) ignored_.add(std::string(kind) + " of " + of, element.count);
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
    if (surfaces_) count_attributes(element, "vertices");
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

  /// The number of the property that lists vertices.
  static build::Result<std::size_t> corners_of(const PlyElement& element) {
    const auto is_corners = [](const PlyProperty& p) {
      return p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    const auto list = std::find_if(element.properties.begin(), element.properties.end(), is_corners);
    if (list != element.properties.end()) return static_cast<std::size_t>(list - element.properties.begin());
    return invalid_input("element " + in_quotes(element.name) +
                         " has no list property 'vertex_indices' or 'vertex_index'");
  }

  static bool is_vertex(double number) { return number >= 0 && number < 4294967296.0 && number == std::floor(number); }

  /// Strips of triangles; -1 begins the next one. Every second triangle of a strip is turned around.
  build::Result<void> read_strips(const PlyElement& element) {
    const auto corners = corners_of(element);
    if (!corners) return tl::unexpected(corners.error());
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::array<std::uint32_t, 2> last{};
      std::uint64_t length = 0;  // Of the strip so far.
      const auto take = [&](std::size_t p, double number) {
        if (p != *corners) return true;
        if (number == -1.0) {
          length = 0;
          return true;
        }
        if (!is_vertex(number)) return false;
        const auto corner = static_cast<std::uint32_t>(number);
        if (length >= 2) {
          const std::size_t odd = length % 2;
          faces_.corners.insert(faces_.corners.end(), {last[odd], last[1 - odd], corner});
          faces_.sizes.push_back(3);
        }
        last = {last[1], corner};
        ++length;
        return true;
      };
      if (auto done = read_record(element, i, take, [](std::size_t, std::uint32_t) {}); !done) return done;
    }
    return {};
  }

  build::Result<void> read_faces(const PlyElement& element) {
    const auto corners = corners_of(element);
    if (!corners) return tl::unexpected(corners.error());
    if (surfaces_) count_attributes(element, "faces");
    faces_.sizes.reserve(element.count);
    faces_.corners.reserve(3 * element.count);
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const auto take = [&](std::size_t p, double number) {
        if (p != *corners) return true;
        if (!is_vertex(number)) return false;
        faces_.corners.push_back(static_cast<std::uint32_t>(number));
        return true;
      };
      const auto length = [&](std::size_t p, std::uint32_t count) {
        if (p == *corners) faces_.sizes.push_back(count);
      };
      if (auto done = read_record(element, i, take, length); !done) return done;
    }
    return {};
  }

  Source source_;
  std::uint64_t values_ = 0;  ///< Read so far.
  Mesh mesh_;
  Polygons faces_;
  Ignored ignored_;
  bool surfaces_;
};

}  // namespace

build::Result<Mesh> read_ply(std::span<const std::byte> bytes, bool surfaces) {
  std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  if (is_utf16(text)) return invalid_input(kUtf16Fault);
  skip_byte_order_mark(text);
  const auto header = parse_ply_header(text);
  if (!header) return tl::unexpected(header.error());
  const auto has = [&](std::string_view name) {
    return std::any_of(header->elements.begin(), header->elements.end(), [&](const auto& e) { return e.name == name; });
  };
  if (!has("vertex")) return invalid_input("the header names no element 'vertex'");
  if (!has("face") && !has("tristrips")) return invalid_input("the header names no element 'face', and no 'tristrips'");
  if (header->encoding == PlyEncoding::kAscii)
    return PlyReader(AsciiSource(text, header->lines), surfaces).read(*header);
  return PlyReader(BinarySource(text, bytes.size() - text.size(), header->encoding == PlyEncoding::kBigEndian),
                   surfaces)
      .read(*header);
}

}  // namespace hiprt::tools
