#pragma once
/// Reads pictures from OpenEXR files.

#include <tools/render/image/color_image.h>

#include <hiprt_build/error.h>

#include <filesystem>
#include <span>

namespace hiprt::tools {

/// Reads the channels R, G and B (half or float) of the first part of an OpenEXR file, of scan lines or tiles (level 0)
/// and any data window, whose corner becomes pixel 0, 0. Other channels are not looked at; values that are not finite
/// are kept.
/// @return kIo (missing, unreadable, empty), kInvalidInput (not an OpenEXR file, damaged or cut off, deep, a channel
/// that is missing, of integers or subsampled) or kTooLarge (more than kMaxSide or kMaxPixels of image.h), each with
/// the path.
build::Result<ColorImage> read_exr_colors(const std::filesystem::path& path);

/// The same of a file's bytes.
/// @param name what messages call it.
build::Result<ColorImage> decode_exr_colors(std::span<const std::byte> bytes, const std::string& name);

}  // namespace hiprt::tools
