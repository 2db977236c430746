// Sums of arrays on the device.

#include <hiprt_build/gpu/device_buffer.h>
#include <tests/gpu/results.h>
#include <tests/gpu/scan_on_device.h>
#include <tests/oracle/meshes.h>

#include <numeric>

using namespace hiprt;
using namespace hiprt::checks;

namespace {

constexpr std::uint64_t kSeed = 20261122;
constexpr std::uint32_t kUntouched = 0xa5a5a5a5u;

/// Scans @p values into another array, or in place. Checks the sums, and that nothing behind the array changed.
void check_scan(const std::vector<std::uint32_t>& values, bool in_place) {
  const auto count = static_cast<std::uint32_t>(values.size());
  gpu::DeviceAllocator allocator;
  std::vector<std::uint32_t> padded = values;
  padded.push_back(kUntouched);
  auto from = must(gpu::DeviceArray<std::uint32_t>::from(padded, nullptr, allocator));
  auto apart = must(gpu::DeviceArray<std::uint32_t>::make(count + 1, nullptr, allocator));
  must(apart.fill(std::byte{0xa5}, nullptr));
  auto all = must(gpu::DeviceArray<std::uint32_t>::make(1, nullptr, allocator));
  auto& to = in_place ? from : apart;
  std::size_t bytes = 0;
  must(scan_on_device(nullptr, bytes, from.data(), to.data(), count, all.data(), nullptr));
  auto temp = must(gpu::DeviceBuffer::make(bytes, nullptr, allocator));
  for (int run = 0; run < (in_place ? 1 : 2); ++run) {
    must(all.fill(std::byte{0x5a}, nullptr));
    must(scan_on_device(temp.data(), bytes, from.data(), to.data(), count, run == 0 ? all.data() : nullptr, nullptr));
    std::vector<std::uint32_t> wanted(values.size());
    std::exclusive_scan(values.begin(), values.end(), wanted.begin(), 0u);
    wanted.push_back(kUntouched);
    REQUIRE(must(to.to_vector(nullptr)) == wanted);
    const std::uint32_t sum = std::accumulate(values.begin(), values.end(), 0u);
    REQUIRE(must(all.to_vector(nullptr))[0] == (run == 0 ? sum : 0x5a5a5a5au));
  }
}

}  // namespace

TEST_CASE("sums of any number of values") {
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (const std::uint32_t count : {0u, 1u, 2u, 31u, 32u, 33u, 255u, 256u, 2047u, 2048u, 2049u, 4096u, 65535u, 65536u,
                                    65537u, 67584u, 67585u, 200001u}) {
    CAPTURE(count);
    std::vector<std::uint32_t> values(count);
    for (std::uint32_t& value : values) value = random.below(20000);
    check_scan(values, false);
    check_scan(values, true);
  }
}

TEST_CASE("sums behind the last value are the total") {
  std::vector<std::uint32_t> values(5000, 0);
  std::iota(values.begin(), values.begin() + 2100, 1u);
  check_scan(values, false);
}
