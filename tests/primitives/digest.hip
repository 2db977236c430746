// Compares the digests of a GPU and of the host. Exit status 0 if they are equal.

#include <hip/hip_runtime.h>
#include <tests/primitives/digest.h>

#include <cstdio>
#include <vector>

namespace {

using namespace hiprt::checks;

template <bool kPoints> __global__ void digest_cases(std::uint64_t* digests, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) digests[i] = kPoints ? digest_points(i) : digest_case(i);
}

/// @return whether the digests of the device and of the host are the expected one.
template <bool kPoints> bool compare(const char* name, std::uint64_t expected) {
  constexpr std::uint32_t kBlock = 64;
  std::vector<std::uint64_t> digests(kDigestCases);
  const std::size_t bytes = digests.size() * sizeof(std::uint64_t);
  std::uint64_t* device = nullptr;
  if (hipMalloc(&device, bytes) != hipSuccess) {
    std::puts("no memory on the device");
    return false;
  }
  digest_cases<kPoints><<<kDigestCases / kBlock, kBlock>>>(device, kDigestCases);
  if (hipMemcpy(digests.data(), device, bytes, hipMemcpyDeviceToHost) != hipSuccess || hipFree(device) != hipSuccess) {
    std::puts("the kernel did not run");
    return false;
  }
  std::uint64_t on_device = 0, on_host = 0;
  std::uint32_t different = 0;
  for (std::uint32_t i = 0; i < kDigestCases; ++i) {
    const std::uint64_t here = kPoints ? digest_points(i) : digest_case(i);
    on_device += digests[i];
    on_host += here;
    different += here != digests[i] ? 1u : 0u;
  }
  std::printf("%s: device %016llx host %016llx expected %016llx: %u of %u cases differ\n", name,
              static_cast<unsigned long long>(on_device), static_cast<unsigned long long>(on_host),
              static_cast<unsigned long long>(expected), different, kDigestCases);
  return on_device == expected && on_host == expected;
}

}  // namespace

int main() {
  const bool hits = compare<false>("hits", kDigest), points = compare<true>("closest points", kPointDigest);
  return hits && points ? 0 : 1;
}
