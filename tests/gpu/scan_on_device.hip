#include <hiprt_build/exec/gpu_scan.h>
#include <tests/gpu/scan_on_device.h>

namespace hiprt::checks {

gpu::Result<void> scan_on_device(void* temp, std::size_t& temp_bytes, const std::uint32_t* values, std::uint32_t* sums,
                                 std::uint32_t count, std::uint32_t* all, hipStream_t stream) {
  return build::exclusive_scan(temp, temp_bytes, values, sums, count, all, stream);
}

}  // namespace hiprt::checks
