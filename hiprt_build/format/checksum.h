#pragma once
/// The checksum of a BVH file: XXH3-64 (seed 0) of all bytes except the eight that hold the checksum.

#include <hiprt_build/export.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace hiprt {

/// @param file the whole file, at least sizeof(FileHeader) bytes. FileHeader::checksum is skipped.
/// @param piece number of bytes, at least 1, after which between() is called, which may throw.
/// @return the value that FileHeader::checksum must have.
HIPRT_BUILD_API std::uint64_t file_checksum(std::span<const std::byte> file, std::size_t piece,
                                            const std::function<void()>& between);

/// The checksum without interruptions.
HIPRT_BUILD_API std::uint64_t file_checksum(std::span<const std::byte> file);

}  // namespace hiprt
