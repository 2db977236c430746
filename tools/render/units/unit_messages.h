#pragma once
/// Units of a picture as messages between ranks.

#include <tools/render/units/unit_pool.h>

#include <hiprt_build/error.h>

namespace hiprt::tools {

/// Without the state before the first step, which is nobody's.
std::vector<std::byte> encode(const UnitJob& job);
/// @return kInvalidInput if the bytes are no job with a state of @p pixel_bytes per pixel.
build::Result<UnitJob> decode_job(std::span<const std::byte> bytes, std::size_t pixel_bytes);

std::vector<std::byte> encode(const UnitResult& result);
build::Result<UnitResult> decode_result(std::span<const std::byte> bytes, std::size_t pixel_bytes);

}  // namespace hiprt::tools
