#include <tools/scene_io/mesh/ply_header.h>

#include <tools/base/errors.h>
#include <tools/base/text.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace hiprt::tools {
namespace {

std::optional<PlyType> type_of(std::string_view word) {
  constexpr std::array<std::pair<std::string_view, PlyType>, 18> kNames{{{"char", PlyType::kInt8},
                                                                         {"int8", PlyType::kInt8},
                                                                         {"uchar", PlyType::kUint8},
                                                                         {"uint8", PlyType::kUint8},
                                                                         {"short", PlyType::kInt16},
                                                                         {"int16", PlyType::kInt16},
                                                                         {"ushort", PlyType::kUint16},
                                                                         {"uint16", PlyType::kUint16},
                                                                         {"int", PlyType::kInt32},
                                                                         {"int32", PlyType::kInt32},
                                                                         {"uint", PlyType::kUint32},
                                                                         {"uint32", PlyType::kUint32},
                                                                         {"int64", PlyType::kInt64},
                                                                         {"uint64", PlyType::kUint64},
                                                                         {"float", PlyType::kFloat32},
                                                                         {"float32", PlyType::kFloat32},
                                                                         {"double", PlyType::kFloat64},
                                                                         {"float64", PlyType::kFloat64}}};
  for (const auto& [name, type] : kNames)
    if (word == name) return type;
  return std::nullopt;
}

class HeaderParser {
 public:
  build::Result<PlyHeader> parse(std::string_view& text) {
    line_break_ = has_cr_lines(text) ? '\r' : '\n';
    if (next(text) != "ply") return fail("a PLY file starts with 'ply'");
    bool has_format = false;
    while (!text.empty()) {
      std::string_view line = next(text);
      const std::string_view keyword = next_word(line);
      if (keyword == "end_header") {
        if (!has_format) return fail("the header has no 'format' line");
        for (const PlyElement& element : header_.elements)
          if (element.properties.empty()) return fail("element " + in_quotes(element.name) + " has no properties");
        return std::move(header_);
      }
      build::Result<void> done;
      if (keyword == "format") {
        done = read_format(line);
        has_format = true;
      } else if (keyword == "element") {
        done = read_element(line);
      } else if (keyword == "property") {
        done = read_property(line);
      } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
        ++header_.ignored_lines;
      }
      if (!done) return tl::unexpected(done.error());
    }
    return fail("truncated: the header has no 'end_header'");
  }

 private:
  /// Do lines end with a CR alone? The first one says it for all: behind a binary file's last line, any byte may
  /// follow.
  static bool has_cr_lines(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_of("\r\n"), text.size()));
    return text.starts_with('\r') && !text.starts_with("\r\n");
  }

  std::string_view next(std::string_view& text) {
    ++header_.lines;
    const std::size_t end = text.find(line_break_);
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return line;
  }

  tl::unexpected<build::Error> fail(const std::string& what) const {
    return invalid_input("line " + std::to_string(header_.lines) + ": " + what);
  }

  build::Result<void> read_format(std::string_view line) {
    const std::string_view word = next_word(line);
    if (word == "ascii")
      header_.encoding = PlyEncoding::kAscii;
    else if (word == "binary_little_endian")
      header_.encoding = PlyEncoding::kLittleEndian;
    else if (word == "binary_big_endian")
      header_.encoding = PlyEncoding::kBigEndian;
    else
      return fail("unknown format " + in_quotes(word));
    if (const std::string_view version = next_word(line); !version.starts_with("1."))
      return fail("unknown version " + in_quotes(version) + ", 1.0 and other 1.x are known");
    return {};
  }

  build::Result<void> read_element(std::string_view line) {
    const std::string_view name = next_word(line), number = next_word(line);
    const auto count = parse_integer(number);
    if (!count || *count < 0) return fail(in_quotes(number) + " is not a number of elements");
    header_.elements.push_back({std::string(name), static_cast<std::uint64_t>(*count), {}});
    return {};
  }

  build::Result<void> read_property(std::string_view line) {
    if (header_.elements.empty()) return fail("a property before the first element");
    PlyProperty property{};
    std::string_view word = next_word(line);
    if (word == "list") {
      const std::string_view length = next_word(line);
      const auto type = type_of(length);
      if (!type) return fail(in_quotes(length) + " is not a type");
      property.is_list = true;
      property.count_type = *type;
      word = next_word(line);
    }
    const auto type = type_of(word);
    if (!type) return fail(in_quotes(word) + " is not a type");
    property.type = *type;
    property.name = std::string(next_word(line));
    header_.elements.back().properties.push_back(std::move(property));
    return {};
  }

  PlyHeader header_;
  char line_break_ = '\n';
};

}  // namespace

unsigned size_of(PlyType type) {
  constexpr std::array<unsigned, 10> kSizes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

build::Result<PlyHeader> parse_ply_header(std::string_view& text) { return HeaderParser{}.parse(text); }

}  // namespace hiprt::tools
