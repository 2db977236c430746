#include <tools/render/image/exr_attributes.h>

#include <tools/base/text.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <utility>

namespace hiprt::tools {
namespace {

constexpr std::size_t kHeaderBytes = 8;  ///< Magic number and version.
constexpr std::uint32_t kMultiPart = 1u << 12;

/// The text up to the next zero byte, which is removed, too; all of it without one.
std::string_view take_name(std::string_view& rest) {
  const std::string_view name = rest.substr(0, rest.find('\0'));
  rest.remove_prefix(std::min(rest.size(), name.size() + 1));
  return name;
}

std::uint32_t number_at(std::string_view text, std::size_t at) {
  std::uint32_t number = 0;
  std::memcpy(&number, text.data() + at, sizeof(number));
  return number;
}

/// Types of one size, in bytes.
constexpr std::array<std::pair<std::string_view, std::size_t>, 24> kSizes{{{"box2i", 16},
                                                                           {"box2f", 16},
                                                                           {"chromaticities", 32},
                                                                           {"compression", 1},
                                                                           {"deepImageState", 1},
                                                                           {"double", 8},
                                                                           {"envmap", 1},
                                                                           {"float", 4},
                                                                           {"int", 4},
                                                                           {"keycode", 28},
                                                                           {"lineOrder", 1},
                                                                           {"m33f", 36},
                                                                           {"m33d", 72},
                                                                           {"m44f", 64},
                                                                           {"m44d", 128},
                                                                           {"rational", 8},
                                                                           {"tiledesc", 9},
                                                                           {"timecode", 8},
                                                                           {"v2i", 8},
                                                                           {"v2f", 8},
                                                                           {"v2d", 16},
                                                                           {"v3i", 12},
                                                                           {"v3f", 12},
                                                                           {"v3d", 24}}};

/// Names with 16 bytes each; an empty name ends the list.
bool is_channel_list(std::string_view value) {
  while (!value.empty()) {
    if (take_name(value).empty()) return value.empty();
    if (value.size() < 16) return false;
    value.remove_prefix(16);
  }
  return false;
}

/// Strings with their lengths before them.
bool is_string_list(std::string_view value) {
  while (!value.empty()) {
    if (value.size() < 4 || number_at(value, 0) > value.size() - 4) return false;
    value.remove_prefix(4 + number_at(value, 0));
  }
  return true;
}

/// OpenEXR reads what the type and the value say, whatever the attribute's size is.
bool fits(std::string_view type, std::string_view value) {
  constexpr std::uint64_t kDeflate = 1032;  // The longest match, 258 bytes, takes two bits.
  for (const auto& [name, size] : kSizes)
    if (type == name) return value.size() == size;
  if (type == "chlist") return is_channel_list(value);
  if (type == "stringvector") return is_string_list(value);
  if (type == "preview")
    return value.size() >= 8 && std::uint64_t{number_at(value, 0)} * number_at(value, 4) == (value.size() - 8) / 4;
  if (type == "idmanifest") return value.size() >= 4 && number_at(value, 0) <= kDeflate * value.size();
  return true;
}

/// What the header of a part says of its chunks: each has an entry of 8 bytes in a table behind the header.
struct Chunks {
  std::uint64_t width = 1, height = 1;            ///< Of the data window.
  std::uint64_t tile_width = 0, tile_height = 0;  ///< 0: scan lines.
  std::uint64_t count = 0;                        ///< Said by the part itself; 0: not said.

  /// At least as many as there are.
  std::uint64_t least() const {
    constexpr std::uint64_t kMostLines = 256;  ///< Of a chunk of scan lines (DWAB).
    const auto parts = [](std::uint64_t whole, std::uint64_t part) { return (whole + part - 1) / part; };
    const bool tiled = tile_width != 0 && tile_height != 0;
    const std::uint64_t pieces =
        tiled ? parts(width, tile_width) * parts(height, tile_height) : parts(height, kMostLines);
    return std::max(count, pieces);
  }

  void read(std::string_view name, std::string_view type, std::string_view value) {
    const auto extent = [&](std::size_t axis) {
      const auto low = static_cast<std::int32_t>(number_at(value, 4 * axis));
      const auto high = static_cast<std::int32_t>(number_at(value, 8 + 4 * axis));
      return high < low ? std::uint64_t{0} : static_cast<std::uint64_t>(std::int64_t{high} - low) + 1;
    };
    if (name == "dataWindow" && type == "box2i" && value.size() == 16) {
      width = extent(0);
      height = extent(1);
    } else if (name == "tiles" && type == "tiledesc" && value.size() == 9) {
      tile_width = number_at(value, 0);
      tile_height = number_at(value, 4);
    } else if (name == "chunkCount" && type == "int" && value.size() == 4) {
      count = number_at(value, 0);
    }
  }
};

/// The attributes that OpenEXR knows by name, with their types.
constexpr std::array<std::pair<std::string_view, std::string_view>, 13> kKnown{{{"channels", "chlist"},
                                                                                {"chunkCount", "int"},
                                                                                {"compression", "compression"},
                                                                                {"dataWindow", "box2i"},
                                                                                {"displayWindow", "box2i"},
                                                                                {"lineOrder", "lineOrder"},
                                                                                {"name", "string"},
                                                                                {"pixelAspectRatio", "float"},
                                                                                {"screenWindowCenter", "v2f"},
                                                                                {"screenWindowWidth", "float"},
                                                                                {"tiles", "tiledesc"},
                                                                                {"type", "string"},
                                                                                {"version", "int"}}};

/// Which attributes of kKnown a header has had.
class KnownAttributes {
 public:
  /// @return what is wrong, or nothing. OpenEXR 3.4 drops such an attribute, and reads on inside its value.
  std::string take(std::string_view name, std::string_view type) {
    for (std::size_t i = 0; i < kKnown.size(); ++i) {
      if (kKnown[i].first != name) continue;
      if (kKnown[i].second != type)
        return "attribute " + in_quotes(name) + " is of type " + in_quotes(type) + ", not " +
               in_quotes(kKnown[i].second);
      if (seen_[i]) return "attribute " + in_quotes(name) + " is there twice";
      seen_[i] = true;
    }
    return {};
  }

 private:
  std::array<bool, kKnown.size()> seen_{};
};

/// What a header has said so far.
struct Part {
  Chunks chunks;
  KnownAttributes known;
};

/// Removes one attribute. @return what is wrong, or nothing.
std::string take_attribute(std::string_view name, std::string_view& rest, Part& part) {
  const std::string_view type = take_name(rest);
  if (rest.size() < 4) return "the header ends inside attribute " + in_quotes(name);
  const std::uint32_t size = number_at(rest, 0);
  rest.remove_prefix(4);
  if (size > rest.size())
    return "attribute " + in_quotes(name) + " has " + std::to_string(size) + " bytes, but only " +
           std::to_string(rest.size()) + " are left in the file";
  if (std::string fault = part.known.take(name, type); !fault.empty()) return fault;
  if (!fits(type, rest.substr(0, size)))
    return "attribute " + in_quotes(name) + " of type " + in_quotes(type) + " does not fit its " +
           std::to_string(size) + " bytes";
  part.chunks.read(name, type, rest.substr(0, size));
  rest.remove_prefix(size);
  return {};
}

}  // namespace

std::string fault_of_exr_attributes(std::span<const std::byte> file) {
  std::string_view rest{reinterpret_cast<const char*>(file.data()), file.size()};
  if (rest.size() < kHeaderBytes) return "the header is cut";
  const bool many = (number_at(rest, 4) & kMultiPart) != 0;
  rest.remove_prefix(kHeaderBytes);
  // An empty name ends the header of a part; of many parts, an empty header ends the list.
  Part part;
  for (bool any = false; !rest.empty();) {
    const std::string_view name = take_name(rest);
    if (name.empty()) {
      if (part.chunks.least() > file.size() / 8)
        return std::to_string(part.chunks.least()) + " chunks, each with 8 bytes in a table, but the file has " +
               std::to_string(file.size()) + " bytes";
      if (!many || !any) break;
      any = false;
      part = {};
      continue;
    }
    any = true;
    if (std::string fault = take_attribute(name, rest, part); !fault.empty()) return fault;
  }
  return {};
}

}  // namespace hiprt::tools
