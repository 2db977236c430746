#pragma once
/// Memory accesses that name the kind of memory.
///
/// AMD's compiler emits flat accesses, which find out the kind at run time, for generic pointers. It does so for
/// choices between pointers of two kinds, too.

#include <hiprt_device/format/portability.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
#define HIPRT_GLOBAL_MEMORY __attribute__((address_space(1)))
#define HIPRT_SHARED_MEMORY __attribute__((address_space(3)))
#else
#define HIPRT_GLOBAL_MEMORY
#define HIPRT_SHARED_MEMORY
#endif

/// An element of an array in global memory (host: any memory).
template <class T> HIPRT_HD HIPRT_FORCE_INLINE T load_global(const T* array, std::size_t i) {
  return ((const HIPRT_GLOBAL_MEMORY T*)array)[i];
}
template <class T> HIPRT_HD HIPRT_FORCE_INLINE void store_global(T* array, std::size_t i, T value) {
  ((HIPRT_GLOBAL_MEMORY T*)array)[i] = value;
}

/// An element of an array in the block's shared memory (host: any memory).
template <class T> HIPRT_HD HIPRT_FORCE_INLINE T load_shared(const T* array, unsigned i) {
  return ((const HIPRT_SHARED_MEMORY T*)array)[i];
}
template <class T> HIPRT_HD HIPRT_FORCE_INLINE void store_shared(T* array, unsigned i, T value) {
  ((HIPRT_SHARED_MEMORY T*)array)[i] = value;
}

/// 16 bytes as four words.
struct Words {
  std::uint32_t word[4];
  HIPRT_HD HIPRT_FORCE_INLINE float as_float(unsigned i) const { return std::bit_cast<float>(word[i]); }
};

/// @param address multiple of 16, in the scene, which nobody writes at the same time.
HIPRT_HD HIPRT_FORCE_INLINE Words load_words(const void* address) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  using Vector = std::uint32_t __attribute__((ext_vector_type(4)));
  const Vector v = *(const HIPRT_GLOBAL_MEMORY Vector*)address;
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

namespace memory_detail {

template <std::size_t kCount> struct WordsOf { Words part[kCount]; };

template <std::size_t... kPart>
HIPRT_HD HIPRT_FORCE_INLINE WordsOf<sizeof...(kPart)> load_parts(const void* address, std::index_sequence<kPart...>) {
  return {{load_words(static_cast<const std::byte*>(address) + kPart * sizeof(Words))...}};
}

}  // namespace memory_detail

/// Loads a record in 16-byte words and skips words that are not used. Divergent lanes pay for every load.
/// @param record in the scene, which nobody writes at the same time, at a multiple of 16 bytes.
template <class Record> HIPRT_HD HIPRT_FORCE_INLINE Record load_record(const Record& record) {
  static_assert(sizeof(Record) % sizeof(Words) == 0);
  return std::bit_cast<Record>(
      memory_detail::load_parts(&record, std::make_index_sequence<sizeof(Record) / sizeof(Words)>{}));
}

/// The same address, about which the compiler knows nothing. Data that is read or computed from it again need not stay
/// in registers.
template <class T> HIPRT_HD HIPRT_FORCE_INLINE const T* forget(const T* address) {
#if HIPRT_DEVICE_CODE && defined(__HIP_DEVICE_COMPILE__)
  asm volatile("" : "+v"(address));
#elif HIPRT_DEVICE_CODE
  asm volatile("" : "+l"(address));
#endif
  return address;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
