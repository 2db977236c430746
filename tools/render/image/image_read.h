#pragma once
/// Reads pictures from OpenEXR files.

#include <tools/render/image/color_image.h>

#include <hiprt_build/error.h>

#include <filesystem>
#include <span>

namespace hiprt::tools {

/// Reads the channels R, G and B (half or float) of the first part of an OpenEXR file. The part may have scan lines or
/// tiles (level 0 is read) and any data window, whose corner becomes pixel 0, 0. Other channels are ignored. Values
/// that are not finite are kept.
/// @return an error with the path:
/// - kIo: the file is missing, unreadable or empty;
/// - kInvalidInput: the file is no OpenEXR file, damaged, truncated or deep; or a channel is missing, has integers or
///   is subsampled;
/// - kTooLarge: more than kMaxSide or kMaxPixels of image.h.
build::Result<ColorImage> read_exr_colors(const std::filesystem::path& path);

/// The same for the bytes of a file. @param name of the file in messages.
build::Result<ColorImage> decode_exr_colors(std::span<const std::byte> bytes, const std::string& name);

}  // namespace hiprt::tools
