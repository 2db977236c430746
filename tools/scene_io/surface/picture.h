#pragma once
/// PNG and JPEG files in memory as textures.

#include <tools/scene_io/surface/surface.h>

#include <hiprt_build/error.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt::tools {

/// Most texels of a side.
inline constexpr std::uint32_t kMostPictureSide = 16384;

/// Decodes a PNG or JPEG file. The first bytes say which one it is. Gamma, colour profiles and orientation are not
/// applied (glTF 2.0, 3.8.1). 16 bits per channel are rounded to 8; grey becomes red,
/// green and blue; without transparency alpha is 255.
/// @param most_texels of a larger picture only the header is read.
/// @return a texture without name; kInvalidInput: it is neither, truncated or damaged; kTooLarge with the size and the
/// limit; kOutOfMemory.
build::Result<Texture> decode_picture(std::span<const std::byte> bytes, std::uint64_t most_texels);

/// decode_picture() for one format. @pre the bytes begin as such a file does.
build::Result<Texture> decode_png(std::span<const std::byte> bytes, std::uint64_t most_texels);
build::Result<Texture> decode_jpeg(std::span<const std::byte> bytes, std::uint64_t most_texels);

/// @return kInvalidInput for an empty picture, kTooLarge.
build::Result<void> check_picture_size(std::uint32_t width, std::uint32_t height, std::uint64_t most_texels);

/// @param bits that the file has for each texel, at least, before compression. @param expansion how many times larger
/// decompression makes data, at most.
/// @return kInvalidInput if a file of so many bytes cannot have so many texels. Then no memory may be asked for.
build::Result<void> check_file_size(std::uint32_t width, std::uint32_t height, std::uint64_t bits,
                                    std::uint64_t expansion, std::uint64_t file_bytes);

}  // namespace hiprt::tools
