#pragma once
/// The header of a PLY file (Turk 1994).

#include <hiprt_build/error.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::tools {

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat32, kFloat64 };

/// Bytes of a value in a binary file.
unsigned size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  ///< Of the list's length; also a real type.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::size_t lines = 0;          ///< Of the header.
  std::size_t ignored_lines = 0;  ///< Those with unknown keywords.
};

/// Cuts the header off @p text. @return kInvalidInput with the line that is wrong.
build::Result<PlyHeader> parse_ply_header(std::string_view& text);

}  // namespace hiprt::tools
