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
/// @return the value that FileHeader::checksum must have.
inline std::uint64_t file_checksum(std::span<const std::byte> file) {
  constexpr std::size_t kBefore = offsetof(FileHeader, checksum);
  constexpr std::size_t kAfter = kBefore + sizeof(FileHeader::checksum);
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, file.data(), kBefore);
  XXH3_64bits_update(&state, file.data() + kAfter, file.size() - kAfter);
  return XXH3_64bits_digest(&state);
}

}  // namespace hiprt
