// The sort of the builders on the device.

#include <hiprt_build/exec/gpu_sort.h>
#include <hiprt_build/gpu/device_buffer.h>
#include <tests/gpu/results.h>
#include <tests/oracle/meshes.h>

#include <algorithm>
#include <numeric>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261126;

/// Sorts @p keys, with their numbers as values. Compares with std::stable_sort, and checks that nothing behind the
/// arrays changed.
void check_sort(const std::vector<std::uint64_t>& keys) {
  const auto count = static_cast<std::uint32_t>(keys.size());
  CAPTURE(count);
  std::vector<std::uint32_t> values(count), wanted(count);
  std::iota(values.begin(), values.end(), 0u);
  wanted = values;
  std::stable_sort(wanted.begin(), wanted.end(), [&](auto a, auto b) { return keys[a] < keys[b]; });
  constexpr std::uint64_t kKeyBehind = 0xa5a5a5a5a5a5a5a5u;
  constexpr std::uint32_t kValueBehind = 0x5a5a5a5au;

  gpu::DeviceAllocator allocator;
  std::vector<std::uint64_t> padded_keys = keys;
  padded_keys.push_back(kKeyBehind);
  std::vector<std::uint32_t> padded_values = values;
  padded_values.push_back(kValueBehind);
  gpu::DeviceArray<std::uint64_t> keys_on_device[2];
  gpu::DeviceArray<std::uint32_t> values_on_device[2];
  build::SortBuffers buffers{};
  for (int k = 0; k < 2; ++k) {
    keys_on_device[k] = must(gpu::DeviceArray<std::uint64_t>::from(padded_keys, nullptr, allocator));
    values_on_device[k] = must(gpu::DeviceArray<std::uint32_t>::from(padded_values, nullptr, allocator));
    buffers.keys[k] = keys_on_device[k].data();
    buffers.values[k] = values_on_device[k].data();
  }
  std::size_t bytes = 0;
  must(build::sort_pairs(nullptr, bytes, buffers, count, nullptr));
  auto temp = must(gpu::DeviceBuffer::make(bytes, nullptr, allocator));
  must(build::sort_pairs(temp.data(), bytes, buffers, count, nullptr));

  const auto sorted_keys = must(keys_on_device[buffers.current].to_vector(nullptr));
  const auto sorted_values = must(values_on_device[buffers.current].to_vector(nullptr));
  for (std::uint32_t i = 0; i < count; ++i)
    if (sorted_values[i] != wanted[i] || sorted_keys[i] != keys[wanted[i]])
      FAIL("place " << i << " has number " << sorted_values[i] << " and not " << wanted[i]);
  for (int k = 0; k < 2; ++k) {
    CHECK(must(keys_on_device[k].to_vector(nullptr)).back() == kKeyBehind);
    CHECK(must(values_on_device[k].to_vector(nullptr)).back() == kValueBehind);
  }
}

/// @param bits of the keys that differ, at the upper end.
std::vector<std::uint64_t> random_keys(std::uint32_t count, unsigned bits, oracle::Random& random) {
  std::vector<std::uint64_t> keys(count);
  for (std::uint64_t& key : keys) {
    key = std::uint64_t{random.below(0xffffffffu)} << 32 | random.below(0xffffffffu);
    key = bits == 0 ? 7 : key >> (64 - bits) << (64 - bits);
  }
  return keys;
}

}  // namespace

TEST_CASE("sorts of any number of keys: equal keys keep their order") {
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (const std::uint32_t count : {1u, 2u, 31u, 33u, 255u, 256u, 257u, 1023u, 1025u, 2047u, 2049u, 4097u, 20001u})
    for (const unsigned bits : {0u, 3u, 64u}) check_sort(random_keys(count, bits, random));
}

// rocPRIM sorts up to a million keys by merging, and more by their digits.
TEST_CASE("a sort of more than a million keys") {
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  check_sort(random_keys((1u << 20) + 12345, 20, random));
}
