#pragma once
/// Prefix sums (scans) over the lanes of a group, the threads of a block, the tiles of a grid, and an array on the
/// device. Nothing is allocated. Internal.

#include <hiprt_build/exec/wave_group.h>
#include <hiprt_build/gpu/launch.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::build {

/// Inclusive scan. @return the sum of the values of this lane and the group's lower lanes.
inline __device__ std::uint32_t sum_up(const WaveGroup& group, std::uint32_t value) {
  for (unsigned step = 1; step < WaveGroup::kLanes; step *= 2) {
    const std::uint32_t before = group.from((group.lane() - step) % WaveGroup::kLanes, value);
    value += group.lane() >= step ? before : 0;
  }
  return value;
}

/// Exclusive scan. @return the sum of the values of the group's lower lanes. @param total becomes the sum of all lanes.
inline __device__ std::uint32_t group_scan(const WaveGroup& group, std::uint32_t value, std::uint32_t& total) {
  const std::uint32_t sum = sum_up(group, value);
  total = group.from(WaveGroup::kLanes - 1, sum);
  return sum - value;
}

/// Exclusive scan. @return the sum of the values of the block's lower threads. @param total becomes the sum of all
/// threads.
/// @param shared memory of the block; it can be used again at once.
template <unsigned kGroups>
__device__ std::uint32_t block_scan(std::uint32_t (&shared)[kGroups], std::uint32_t value, std::uint32_t& total) {
  const unsigned my_group = threadIdx.x / WaveGroup::kLanes;
  const WaveGroup group;
  std::uint32_t of_group = 0;
  std::uint32_t result = group_scan(group, value, of_group);
  if (group.lane() == 0) shared[my_group] = of_group;
  __syncthreads();
  total = 0;
  for (unsigned g = 0; g < kGroups; ++g) {
    result += g < my_group ? shared[g] : 0;
    total += shared[g];
  }
  __syncthreads();
  return result;
}

/// Scan over the tiles of a grid, whose blocks take tiles in turn (Merrill and Garland, "Single-pass parallel prefix
/// scan with decoupled look-back", 2016). A block that waits for the sum of an earlier tile waits for a running block:
/// the one that took that tile. Sum and state of a tile are one word, so no memory fence is needed.
class TileSums {
 public:
  /// @param taken counts the taken tiles; 0 at first. @param words one per tile; at first 0, or from other epochs.
  /// @param epoch not 0.
  HIPRT_HD TileSums(std::uint32_t* taken, std::uint64_t* words, std::uint32_t epoch)
      : taken_(taken), words_(words), epoch_(epoch) {}

  /// For one thread of the block. @return a tile that no block has taken.
  __device__ std::uint32_t take() const { return fetch_add(taken_, 1); }

  /// For one group of the block that took the tile. @return the sum of the totals of the tiles before.
  __device__ std::uint32_t before(const WaveGroup& group, std::uint32_t tile, std::uint32_t total) const {
    if (tile == 0) {
      publish(group, tile, kAll, total);
      return 0;
    }
    publish(group, tile, kOwn, total);
    std::uint32_t sum = 0;
    for (std::uint32_t end = tile;; end -= WaveGroup::kLanes) {
      // Tile 0 publishes kAll, so lanes that would look before tile 0 are not relevant.
      const std::uint32_t lane = group.lane(), mine = end - 1 - lane;
      std::uint32_t value = 0, relevant = 0, all = 0;
      for (bool waits = true; waits;) {
        const std::uint64_t word = lane < end ? load_shared(&words_[mine]) : 0;
        const auto state = static_cast<std::uint32_t>(word >> 32);
        value = static_cast<std::uint32_t>(word);
        all = group.ballot(state == (epoch_ << 1 | kAll));
        relevant = all == 0 ? 0xffffffffu : all ^ (all - 1);
        waits = (group.ballot(state >> 1 == epoch_) & relevant) != relevant;
      }
      std::uint32_t of_group = 0;
      group_scan(group, (relevant >> lane & 1u) != 0 ? value : 0, of_group);
      sum += of_group;
      if (all != 0) break;
    }
    publish(group, tile, kAll, sum + total);
    return sum;
  }

 private:
  /// What the sum in a tile's word covers: this tile alone, or this tile and all tiles before it.
  static constexpr std::uint32_t kOwn = 0, kAll = 1;

  __device__ void publish(const WaveGroup& group, std::uint32_t tile, std::uint32_t kind, std::uint32_t sum) const {
    if (group.lane() == 0) store_shared(&words_[tile], std::uint64_t{epoch_ << 1 | kind} << 32 | sum);
  }

  std::uint32_t* taken_;
  std::uint64_t* words_;
  std::uint32_t epoch_;
};

namespace gpu_scan_detail {

inline constexpr unsigned kBlock = 256, kEach = 8, kTile = kBlock * kEach;

static __global__ void __launch_bounds__(kBlock) scan_tile(const std::uint32_t* values, std::uint32_t* sums,
                                                           std::uint32_t count, std::uint32_t* all, TileSums tiles) {
  __shared__ std::uint32_t shared[kBlock / WaveGroup::kLanes], my_tile, before_tile;
  if (threadIdx.x == 0) my_tile = tiles.take();
  __syncthreads();
  const std::uint32_t tile = my_tile, first = tile * kTile + threadIdx.x * kEach;
  std::uint32_t mine[kEach], sum = 0, total = 0;
  for (unsigned k = 0; k < kEach; ++k) sum += mine[k] = first + k < count ? values[first + k] : 0;
  std::uint32_t before = block_scan(shared, sum, total);
  if (threadIdx.x < WaveGroup::kLanes) {
    const std::uint32_t earlier = tiles.before(WaveGroup{}, tile, total);
    if (threadIdx.x == 0) {
      before_tile = earlier;
      if (all != nullptr && tile == gridDim.x - 1) *all = earlier + total;
    }
  }
  __syncthreads();
  before += before_tile;
  for (unsigned k = 0; k < kEach; ++k) {
    if (first + k < count) sums[first + k] = before;
    before += mine[k];
  }
}

}  // namespace gpu_scan_detail

/// @return the bytes of temporary memory that a scan of so many values needs.
inline std::size_t scan_bytes(std::uint32_t count) {
  using namespace gpu_scan_detail;
  return (std::size_t{(count + kTile - 1) / kTile} + 1) * sizeof(std::uint64_t);
}

/// sums[i] = values[0] + ... + values[i - 1], in 32 bits. If only the device knows the number of values, fill the rest
/// of @p count with 0. The sums behind the last value are then the sum of all.
/// @param temp aligned to 8 bytes. If nullptr, the function only stores the needed size in @p temp_bytes.
/// @param sums may be @p values. @param all nullptr, or receives the sum of all values.
/// @pre count < 2^32 - 2048
inline gpu::Result<void> exclusive_scan(void* temp, std::size_t& temp_bytes, const std::uint32_t* values,
                                        std::uint32_t* sums, std::uint32_t count, std::uint32_t* all,
                                        hipStream_t stream) {
  using namespace gpu_scan_detail;
  const std::uint32_t tiles = (count + kTile - 1) / kTile;
  const std::size_t bytes = scan_bytes(count);
  if (temp == nullptr) {
    temp_bytes = bytes;
    return {};
  }
  if (count == 0)
    return all == nullptr ? gpu::Result<void>{}
                          : gpu::check(hipMemsetAsync(all, 0, sizeof *all, stream), "hipMemsetAsync", "the sum");
  if (auto cleared = gpu::check(hipMemsetAsync(temp, 0, bytes, stream), "hipMemsetAsync", "sums of tiles"); !cleared)
    return cleared;
  auto* words = static_cast<std::uint64_t*>(temp);
  const TileSums sums_of_tiles(reinterpret_cast<std::uint32_t*>(words + tiles), words, 1);
  return gpu::launch(scan_tile, gpu::Grid{tiles}, stream, {.block = kBlock, .name = "scan_tile"}, values, sums, count,
                     all, sums_of_tiles);
}

}  // namespace hiprt::build
