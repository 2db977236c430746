#pragma once
/// Sizes in the header of an OpenEXR file. OpenEXR allocates what an attribute says before it reads the attribute.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace hiprt::tools {

/// No method of compression makes a file smaller by more: of deflate, after the runs that DWA makes first.
inline constexpr std::uint64_t kMostExrExpansion = 1u << 16;

/// Walks the attributes of all parts. @param file a whole file, with its magic number.
/// @return what is wrong; empty: nothing. An attribute must not be longer than the rest of the file. Its content must
/// fit in it, and the table of chunks in the file. An attribute that OpenEXR knows by name must have the type that
/// belongs to the name, and be there once.
std::string fault_of_exr_attributes(std::span<const std::byte> file);

}  // namespace hiprt::tools
