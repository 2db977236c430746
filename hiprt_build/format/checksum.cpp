#include <hiprt_build/format/checksum.h>
#include <hiprt_device/format/buffer.h>

#ifndef XXH_INLINE_ALL
#define XXH_INLINE_ALL
#endif
#include <xxhash.h>

#include <algorithm>

namespace hiprt {

std::uint64_t file_checksum(std::span<const std::byte> file, std::size_t piece, const std::function<void()>& between) {
  constexpr std::size_t kBefore = offsetof(FileHeader, checksum);
  constexpr std::size_t kAfter = kBefore + sizeof(FileHeader::checksum);
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, file.data(), kBefore);
  for (std::size_t at = kAfter; at < file.size(); at += piece) {
    XXH3_64bits_update(&state, file.data() + at, std::min(piece, file.size() - at));
    between();
  }
  return XXH3_64bits_digest(&state);
}

std::uint64_t file_checksum(std::span<const std::byte> file) {
  return file_checksum(file, file.size(), [] {});
}

}  // namespace hiprt
