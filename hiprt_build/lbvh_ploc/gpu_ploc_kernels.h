#pragma once
/// Rounds of locally-ordered clustering on the device. Internal.
///
/// A block loads a tile of clusters into shared memory, with neighbours up to twice the radius on either side. So it
/// knows the nearest of all clusters that a cluster of the tile may join. Clusters that stay close up in their order.

#include <hiprt_build/exec/gpu_scan.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/lbvh_ploc/ploc_steps.h>

#include <array>
#include <bit>

namespace hiprt::build::kernels {

inline constexpr unsigned kPlocBlock = 256, kPlocLastBlock = 512;
/// So many clusters and fewer are joined by one block.
inline constexpr std::uint32_t kPlocFew = 1024;
inline constexpr unsigned kPlocMostRadius = 128;
/// Blocks need less shared memory up to this one.
inline constexpr unsigned kPlocSmallRadius = 16;

struct PlocLeaves {
  const Reference* references;

  HIPRT_HD HIPRT_FORCE_INLINE Box box(std::uint32_t leaf) const { return references[leaf].box; }
};

/// A round that a launch makes.
struct PlocRound {
  PlocProgress before;
  std::uint32_t taken;  ///< Tiles.
};

struct PlocJob {
  LinkedTree<PlocLeaves, NoSums> tree;
  Cluster *even, *odd;   ///< Written by rounds 0, 2, ... and 1, 3, ...
  PlocRound* rounds;     ///< One per launch, and one for the last.
  std::uint64_t* words;  ///< Of TileSums.
  std::uint32_t radius;

  /// The i-th cluster before a round.
  HIPRT_HD HIPRT_FORCE_INLINE Cluster cluster(const PlocProgress& now, std::uint32_t i) const {
    if (now.rounds == 0) return leaf_cluster(tree.leaves.box(i), i);
    return now.rounds % 2 != 0 ? even[i] : odd[i];
  }
  /// Where a round writes.
  HIPRT_HD HIPRT_FORCE_INLINE Cluster* next(const PlocProgress& now) const { return now.rounds % 2 == 0 ? even : odd; }
};

/// How a block of @p kBlock threads works on its tile, by a radius up to @p kMostRadius. Clusters are named by their
/// positions among all, as 32-bit numbers that wrap around: those before the first are no positions of clusters either.
template <unsigned kBlock, unsigned kMostRadius> class PlocTile {
 public:
  /// Clusters whose nearest is looked for: the tile and the radius to either side.
  static constexpr std::uint32_t kRows = 2, kWindow = kRows * kBlock, kGroups = kWindow / WaveGroup::kLanes;
  static_assert(kWindow > 2 * kMostRadius && kGroups <= WaveGroup::kLanes);

  /// And those around whose boxes are looked at.
  static constexpr std::uint32_t kAll = kWindow + 2 * kMostRadius;

  struct Shared {
    std::uint32_t clusters[sizeof(Cluster) / sizeof(std::uint32_t)][kAll];
    std::uint32_t nearest[kWindow];
    std::uint32_t staying[kGroups];  ///< Bits.
    std::uint32_t first[kGroups];    ///< Where the first of them goes.
  };

  HIPRT_HD static constexpr std::uint32_t size(std::uint32_t radius) { return kWindow - 2 * radius; }
  /// @pre clusters > 0
  HIPRT_HD static constexpr std::uint32_t tiles(std::uint32_t clusters, std::uint32_t radius) {
    return (clusters - 1) / size(radius) + 1;
  }
  __device__ PlocTile(const PlocJob& job, const PlocProgress& now, std::uint32_t tile, Shared& shared)
      : job_(job), now_(now), begin_(tile * size(job.radius)), shared_(shared) {}

  /// @param before(group, total) called by the block's first group: the clusters that stay of the tiles before, if
  ///        @p total stay of this one.
  template <class Before> __device__ void operator()(const Before& before) const {
    load();
    __syncthreads();
    find_nearest();
    __syncthreads();
    PlocAction actions[kRows];
#pragma unroll
    for (std::uint32_t row = 0; row < kRows; ++row) actions[row] = decide(row);
    __syncthreads();
    if (threadIdx.x < WaveGroup::kLanes) find_offset(before);
    __syncthreads();
#pragma unroll
    for (std::uint32_t row = 0; row < kRows; ++row) write(row, actions[row]);
  }

 private:
  /// The position of the window's k-th cluster, and the k of a position.
  __device__ std::uint32_t index_of(std::uint32_t k) const { return begin_ - job_.radius + k; }
  __device__ std::uint32_t in_window(std::uint32_t index) const { return index - begin_ + job_.radius; }

  __device__ void load() const {
    const std::uint32_t first = begin_ - 2 * job_.radius, all = kWindow + 2 * job_.radius;
    for (std::uint32_t m = threadIdx.x; m < all; m += kBlock) {
      if (first + m >= now_.count) continue;
      const Cluster mine = job_.cluster(now_, first + m);
      const auto words = std::bit_cast<std::array<std::uint32_t, 8>>(mine);
#pragma unroll
      for (unsigned w = 0; w < 8; ++w) shared_.clusters[w][m] = words[w];
    }
  }
  __device__ float number(unsigned w, std::uint32_t m) const { return std::bit_cast<float>(shared_.clusters[w][m]); }
  __device__ Box box(std::uint32_t index) const {
    const std::uint32_t m = in_window(index) + job_.radius;
    return Box{{number(0, m), number(1, m), number(2, m)}, {number(3, m), number(4, m), number(5, m)}};
  }
  __device__ Cluster cluster(std::uint32_t index) const {
    const std::uint32_t m = in_window(index) + job_.radius;
    return Cluster{box(index), shared_.clusters[6][m], shared_.clusters[7][m]};
  }

  __device__ void find_nearest() const {
    for (std::uint32_t k = threadIdx.x; k < kWindow; k += kBlock) {
      const std::uint32_t i = index_of(k);
      if (i >= now_.count) continue;
      shared_.nearest[k] = now_.neighbours != 0
                               ? ploc_neighbour(i, now_.count)
                               : ploc_nearest(i, now_.count, job_.radius, [this](std::uint32_t j) { return box(j); });
    }
  }

  /// Of this thread's cluster in a row of the window. kGoes: or it is none of the tile's.
  __device__ PlocAction decide(std::uint32_t row) const {
    const std::uint32_t k = row * kBlock + threadIdx.x, i = index_of(k);
    PlocAction action = PlocAction::kGoes;
    if (k >= job_.radius && k < kWindow - job_.radius && i < now_.count)
      action = ploc_action(i, [this](std::uint32_t index) { return shared_.nearest[in_window(index)]; });
    const WaveGroup group;
    const std::uint32_t staying = group.ballot(action != PlocAction::kGoes);
    if (group.lane() == 0) shared_.staying[k / WaveGroup::kLanes] = staying;
    return action;
  }

  template <class Before> __device__ void find_offset(const Before& before) const {
    const WaveGroup group;
    const std::uint32_t staying = group.lane() < kGroups ? lane_count(shared_.staying[group.lane()]) : 0;
    std::uint32_t total = 0;
    const std::uint32_t in_tile = group_scan(group, staying, total);
    const std::uint32_t earlier = before(group, total);
    if (group.lane() < kGroups) shared_.first[group.lane()] = earlier + in_tile;
  }

  __device__ void write(std::uint32_t row, PlocAction action) const {
    if (action == PlocAction::kGoes) return;
    const std::uint32_t k = row * kBlock + threadIdx.x, i = index_of(k), g = k / WaveGroup::kLanes;
    const std::uint32_t lower = shared_.staying[g] & ((1u << k % WaveGroup::kLanes) - 1);
    Cluster mine = cluster(i);
    if (action == PlocAction::kJoins) mine = join(job_.tree, mine, cluster(shared_.nearest[k]));
    job_.next(now_)[shared_.first[g] + lane_count(lower)] = mine;
  }

  const PlocJob& job_;
  const PlocProgress& now_;
  std::uint32_t begin_;
  Shared& shared_;
};

/// @param words how many the rounds need.
static __global__ void __launch_bounds__(kPlocBlock)
    ploc_start(PlocJob job, const std::uint32_t* count, std::uint32_t rounds, std::uint32_t words) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < words) job.words[i] = 0;
  if (i <= rounds) job.rounds[i] = PlocRound{PlocProgress::start(i == 0 ? *count : 0), 0};
}

/// A round over many clusters; does nothing where few are left.
template <unsigned kMostRadius>
__global__ void __launch_bounds__(kPlocBlock) ploc_round(PlocJob job, std::uint32_t round) {
  using Tile = PlocTile<kPlocBlock, kMostRadius>;
  __shared__ typename Tile::Shared shared;
  __shared__ std::uint32_t taken;
  const PlocProgress now = job.rounds[round].before;
  PlocProgress* after = &job.rounds[round + 1].before;
  if (now.count <= kPlocFew) {
    if (blockIdx.x == 0 && threadIdx.x == 0) *after = now;
    return;
  }
  const TileSums sums(&job.rounds[round].taken, job.words, round + 1);
  const std::uint32_t tiles = Tile::tiles(now.count, job.radius);
  for (;;) {
    if (threadIdx.x == 0) taken = sums.take();
    __syncthreads();
    const std::uint32_t tile = taken;
    if (tile >= tiles) return;
    Tile(job, now, tile, shared)([&](const WaveGroup& group, std::uint32_t total) {
      const std::uint32_t before = sums.before(group, tile, total);
      if (tile == tiles - 1 && group.lane() == 0) *after = now.next(before + total);
      return before;
    });
  }
}

/// All rounds that are left, by one block.
static __global__ void __launch_bounds__(kPlocLastBlock) ploc_finish(PlocJob job, std::uint32_t round) {
  using Tile = PlocTile<kPlocLastBlock, kPlocMostRadius>;
  __shared__ Tile::Shared shared;
  __shared__ std::uint32_t left;
  PlocProgress now = job.rounds[round].before;
  while (now.count > 1) {
    const std::uint32_t tiles = Tile::tiles(now.count, job.radius);
    std::uint32_t sum = 0;
    for (std::uint32_t tile = 0; tile < tiles; ++tile) {
      Tile(job, now, tile, shared)([&](const WaveGroup&, std::uint32_t total) {
        const std::uint32_t before = sum;
        sum += total;
        return before;
      });
      __syncthreads();
    }
    if (threadIdx.x == 0) left = sum;
    __syncthreads();
    now = now.next(left);
  }
  if (threadIdx.x == 0) *job.tree.root = now.count == 0 ? kInvalidId : job.cluster(now, 0).ref;
}

}  // namespace hiprt::build::kernels
