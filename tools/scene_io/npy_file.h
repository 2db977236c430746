#pragma once
/// Arrays of numpy in files: the format .npy, versions 1.0 to 3.0 (NEP 1 of numpy).
///
///     0   "\x93NUMPY", u8 major version, u8 minor version
///     8   u16 (version 1) or u32: bytes of the text that follows
///     ..  a Python dictionary: {'descr': '<f4', 'fortran_order': False, 'shape': (5, 3), }, blanks, a line break
///     ..  the values

#include <hiprt_build/error.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::tools {

/// What a .npy file says about its values.
struct NpyHeader {
  std::string type;  ///< '<f4' is float32, little-endian. Of structured arrays the whole list: "[...]".
  bool is_structured = false;
  bool fortran_order = false;        ///< The first index runs fastest, not the last.
  std::vector<std::uint64_t> shape;  ///< Empty: one value.
  std::size_t values = 0;            ///< Where they begin in the file.
};

/// Whether a name ends in .npy.
bool is_npy_name(const std::filesystem::path& path);
/// Whether a file begins as .npy files do.
bool is_npy(std::span<const std::byte> bytes);

/// @param path for messages. @return kInvalidInput with the byte at which the header is wrong.
build::Result<NpyHeader> read_npy_header(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// "(5, 3)", as Python writes a tuple.
std::string shape_text(std::span<const std::uint64_t> shape);

/// The bytes before the values, of version 1.0, in C order. Values begin at a multiple of 64 bytes, as numpy's do.
/// @param type as Python writes it: "'<u4'", or a list of fields.
std::string npy_header(std::string_view type, std::span<const std::uint64_t> shape);

}  // namespace hiprt::tools
