#pragma once
/// Sorts 64-bit keys with 32-bit values on the device. Equal keys keep their order. Nothing is allocated. Internal.
///
/// NVIDIA: CUB. AMD: rocPRIM on the architectures that the installed one knows (HIPRT_ROCPRIM_ARCHS), else our own
/// radix sort. The results are the same.

#include <hiprt_build/gpu/error.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::build {

/// Two arrays of each kind; where the sorted ones are is known after sort_pairs().
struct SortBuffers {
  std::uint64_t* keys[2];
  std::uint32_t* values[2];
  unsigned current = 0;  ///< Which of the two holds the input, and then the result.
};

/// @param temp nullptr: only says how many bytes it must have.
gpu::Result<void> sort_pairs(void* temp, std::size_t& temp_bytes, SortBuffers& buffers, std::uint32_t count,
                             hipStream_t stream);

}  // namespace hiprt::build
