#include <hiprt_build/exec/gpu_sort.h>

#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/gpu/launch.h>

// hipcc's pass for an architecture that rocPRIM does not know has HIPRT_ROCPRIM 0, its host pass 1: the host then
// launches the kernels of rocPRIM on the GPUs of HIPRT_ROCPRIM_ARCHS only.
#if defined(__CUDACC__)
#include <cub/device/device_radix_sort.cuh>
#elif HIPRT_ROCPRIM
#include <hiprt_build/gpu/device.h>

#include <rocprim/device/device_radix_sort.hpp>
#endif

#include <algorithm>
#include <string_view>

namespace hiprt::build {

#if defined(__CUDACC__)

gpu::Result<void> sort_pairs(void* temp, std::size_t& temp_bytes, SortBuffers& buffers, std::uint32_t count,
                             hipStream_t stream) {
  cub::DoubleBuffer<std::uint64_t> keys(buffers.keys[buffers.current], buffers.keys[buffers.current ^ 1]);
  cub::DoubleBuffer<std::uint32_t> values(buffers.values[buffers.current], buffers.values[buffers.current ^ 1]);
  const hipError_t status = cub::DeviceRadixSort::SortPairs(temp, temp_bytes, keys, values, count, 0, 64, stream);
  buffers.current = keys.Current() == buffers.keys[0] ? 0 : 1;
  return gpu::check(status, "cub::DeviceRadixSort::SortPairs", count, " keys");
}

#else

namespace gpu_sort_detail {

inline constexpr unsigned kDigits = 256, kBlock = 256, kRounds = 8, kTile = kBlock * kRounds;
inline constexpr unsigned kGroups = kBlock / WaveGroup::kLanes;

inline __device__ unsigned digit(std::uint64_t key, unsigned shift) {
  return static_cast<unsigned>(key >> shift) & 255u;
}

/// counts[digit * tiles + tile]
static __global__ void __launch_bounds__(kBlock)
    count_digits(const std::uint64_t* keys, std::uint32_t count, unsigned shift, std::uint32_t* counts) {
  __shared__ std::uint32_t here[kDigits];
  here[threadIdx.x] = 0;
  __syncthreads();
  const std::uint32_t begin = blockIdx.x * kTile;
  for (unsigned round = 0; round < kRounds; ++round) {
    const std::uint32_t i = begin + round * kBlock + threadIdx.x;
    if (i < count) fetch_add(&here[digit(keys[i], shift)], 1);
  }
  __syncthreads();
  counts[std::size_t{threadIdx.x} * gridDim.x + blockIdx.x] = here[threadIdx.x];
}

/// Block d turns the counts of digit d into sums of those before; totals[d]: of all.
static __global__ void __launch_bounds__(kBlock)
    scan_digit(std::uint32_t* counts, std::uint32_t tiles, std::uint32_t* totals) {
  __shared__ std::uint32_t shared[kGroups];
  std::uint32_t* mine = counts + std::size_t{blockIdx.x} * tiles;
  std::uint32_t sum = 0;
  for (std::uint32_t begin = 0; begin < tiles; begin += kBlock) {
    const std::uint32_t i = begin + threadIdx.x;
    const std::uint32_t value = i < tiles ? mine[i] : 0;
    std::uint32_t total = 0;
    const std::uint32_t before = block_scan(shared, value, total);
    if (i < tiles) mine[i] = sum + before;
    sum += total;
  }
  if (threadIdx.x == 0) totals[blockIdx.x] = sum;
}

/// Lanes of the group with the same digit, among those with a key.
inline __device__ std::uint32_t match(const WaveGroup& group, unsigned digit, bool present) {
  std::uint32_t same = group.ballot(present);
  for (unsigned bit = 0; bit < 8; ++bit) {
    const bool set = (digit >> bit & 1u) != 0;
    const std::uint32_t with = group.ballot(set);
    same &= set ? with : ~with;
  }
  return same;
}

static __global__ void __launch_bounds__(kBlock)
    scatter(const std::uint64_t* keys, const std::uint32_t* values, std::uint32_t count, unsigned shift,
            const std::uint32_t* counts, const std::uint32_t* totals, std::uint64_t* to_keys,
            std::uint32_t* to_values) {
  __shared__ std::uint32_t next[kDigits], shared[kGroups], in_group[kGroups][kDigits];
  std::uint32_t all = 0;
  const std::uint32_t before = block_scan(shared, totals[threadIdx.x], all);
  next[threadIdx.x] = before + counts[std::size_t{threadIdx.x} * gridDim.x + blockIdx.x];
  const WaveGroup group;
  const unsigned my_group = threadIdx.x / WaveGroup::kLanes;
  for (unsigned round = 0; round < kRounds; ++round) {
    for (unsigned g = 0; g < kGroups; ++g) in_group[g][threadIdx.x] = 0;
    __syncthreads();
    const std::uint32_t i = blockIdx.x * kTile + round * kBlock + threadIdx.x;
    const bool present = i < count;
    const std::uint64_t key = present ? keys[i] : 0;
    const unsigned d = digit(key, shift);
    const std::uint32_t same = match(group, d, present);
    const std::uint32_t rank = lane_count(same & ((1u << group.lane()) - 1));
    if (present && rank == 0) in_group[my_group][d] = lane_count(same);
    __syncthreads();
    if (present) {
      std::uint32_t to = next[d] + rank;
      for (unsigned g = 0; g < my_group; ++g) to += in_group[g][d];
      to_keys[to] = key;
      to_values[to] = values[i];
    }
    __syncthreads();
    for (unsigned g = 0; g < kGroups; ++g) next[threadIdx.x] += in_group[g][threadIdx.x];
    __syncthreads();
  }
}

}  // namespace gpu_sort_detail

namespace {

gpu::Result<void> own_sort(void* temp, std::size_t& temp_bytes, SortBuffers& buffers, std::uint32_t count,
                           hipStream_t stream) {
  using namespace gpu_sort_detail;
  const std::uint32_t tiles = (count + kTile - 1) / kTile;
  if (temp == nullptr) {
    temp_bytes = (std::size_t{kDigits} * tiles + kDigits) * sizeof(std::uint32_t);
    return {};
  }
  if (count == 0) return {};
  auto* totals = static_cast<std::uint32_t*>(temp);
  std::uint32_t* counts = totals + kDigits;
  for (unsigned shift = 0; shift < 64; shift += 8) {
    const unsigned from = buffers.current, to = from ^ 1u;
    auto done = gpu::launch(count_digits, gpu::Grid{tiles}, stream, {.block = kBlock, .name = "count_digits"},
                            buffers.keys[from], count, shift, counts);
    if (done)
      done = gpu::launch(scan_digit, gpu::Grid{kDigits}, stream, {.block = kBlock, .name = "scan_digit"}, counts, tiles,
                         totals);
    if (done)
      done = gpu::launch(scatter, gpu::Grid{tiles}, stream, {.block = kBlock, .name = "scatter"}, buffers.keys[from],
                         buffers.values[from], count, shift, counts, totals, buffers.keys[to], buffers.values[to]);
    if (!done) return done;
    buffers.current = to;
  }
  return {};
}

#if HIPRT_ROCPRIM

gpu::Result<void> rocprim_sort(void* temp, std::size_t& temp_bytes, SortBuffers& buffers, std::uint32_t count,
                               hipStream_t stream) {
  rocprim::double_buffer<std::uint64_t> keys(buffers.keys[buffers.current], buffers.keys[buffers.current ^ 1]);
  rocprim::double_buffer<std::uint32_t> values(buffers.values[buffers.current], buffers.values[buffers.current ^ 1]);
  const hipError_t status = rocprim::radix_sort_pairs(temp, temp_bytes, keys, values, count, 0, 64, stream);
  buffers.current = keys.current() == buffers.keys[0] ? 0 : 1;
  return gpu::check(status, "rocprim::radix_sort_pairs", count, " keys");
}

/// Whether rocPRIM knows the current device. The runtime says for each device once what it is.
///
/// A question that fails must not count as no: the two sorts need different amounts of memory.
gpu::Result<bool> rocprim_knows_device() {
  constexpr std::string_view kKnown = " " HIPRT_ROCPRIM_ARCHS " ";
  int index = 0;
  if (auto got = gpu::check(hipGetDevice(&index), "hipGetDevice"); !got) return tl::unexpected(got.error());
  static thread_local int asked = -1;
  static thread_local bool knows = false;
  if (asked != index) {
    const auto device = gpu::device_detail::read(index);
    if (!device) return tl::unexpected(device.error());
    knows = kKnown.find(" " + device->architecture + " ") != std::string_view::npos;
    asked = index;
  }
  return knows;
}

#endif

}  // namespace

gpu::Result<void> sort_pairs(void* temp, std::size_t& temp_bytes, SortBuffers& buffers, std::uint32_t count,
                             hipStream_t stream) {
#if HIPRT_ROCPRIM
  if (count > 0) {
    const auto by_rocprim = rocprim_knows_device();
    if (!by_rocprim) return tl::unexpected(by_rocprim.error());
    if (*by_rocprim) return rocprim_sort(temp, temp_bytes, buffers, count, stream);
  }
#endif
  return own_sort(temp, temp_bytes, buffers, count, stream);
}

#endif

}  // namespace hiprt::build
