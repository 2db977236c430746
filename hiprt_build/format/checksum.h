#pragma once
/// The checksum of a BVH file: XXH3-64 (seed 0) of all its bytes but the eight that hold the checksum. Host only.

#include <hiprt_device/format/buffer.h>

#ifndef XXH_INLINE_ALL
#define XXH_INLINE_ALL
#endif
#include <xxhash.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt {

/// @param file the whole file, at least sizeof(FileHeader) bytes; what FileHeader::checksum holds does not matter.
/// @param piece bytes, at least 1, after which between() is called, which may throw.
/// @return the value that FileHeader::checksum must have.
template <class Between>
std::uint64_t file_checksum(std::span<const std::byte> file, std::size_t piece, const Between& between) {
  constexpr std::size_t kBefore = offsetof(FileHeader, checksum);
  constexpr std::size_t kAfter = kBefore + sizeof(FileHeader::checksum);
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, file.data(), kBefore);
  for (std::size_t at = kAfter; at < file.size(); at += piece) {
    XXH3_64bits_update(&state, file.data() + at, piece < file.size() - at ? piece : file.size() - at);
    between();
  }
  return XXH3_64bits_digest(&state);
}

/// The same in one go.
inline std::uint64_t file_checksum(std::span<const std::byte> file) {
  return file_checksum(file, file.size(), [] {});
}

}  // namespace hiprt
