#pragma once
/// build::exclusive_scan() for C++ sources.

#include <hiprt_build/gpu/error.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::checks {

gpu::Result<void> scan_on_device(void* temp, std::size_t& temp_bytes, const std::uint32_t* values, std::uint32_t* sums,
                                 std::uint32_t count, std::uint32_t* all, hipStream_t stream);

}  // namespace hiprt::checks
