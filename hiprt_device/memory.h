#pragma once
/// Reads of the scene's bytes. On GPUs they are 16 bytes wide and go to global memory by name: a generic pointer would
/// make the compiler emit accesses that have to find out the kind of memory at run time (flat on AMD).

#include <hiprt_device/format/portability.h>

#include <bit>
#include <cstdint>
#include <cstring>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// 16 bytes as four words.
struct Words {
  std::uint32_t word[4];
  HIPRT_HD HIPRT_INLINE float as_float(unsigned i) const { return std::bit_cast<float>(word[i]); }
};

/// @param address multiple of 16, in the scene's memory, which no one writes meanwhile.
HIPRT_HD HIPRT_INLINE Words load_words(const void* address) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  using Vector = std::uint32_t __attribute__((ext_vector_type(4)));
  const Vector v = *(const __attribute__((address_space(1))) Vector*)address;
  return {{v.x, v.y, v.z, v.w}};
#elif HIPRT_DEVICE_CODE
  const uint4 v = __ldg(static_cast<const uint4*>(address));
  return {{v.x, v.y, v.z, v.w}};
#else
  Words words;
  std::memcpy(&words, address, sizeof(words));
  return words;
#endif
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
