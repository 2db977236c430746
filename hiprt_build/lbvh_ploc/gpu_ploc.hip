#include <hiprt_build/lbvh_ploc/gpu_ploc.h>

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/lbvh_ploc/gpu_ploc_kernels.h>

#include <algorithm>
#include <bit>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Cluster;

/// Rounds over many clusters that are launched: in scenes about four halve the number of clusters, in bundles of long
/// triangles more. The last block makes the rounds that are left. With a quarter of a million leaves a round takes
/// 1 % of the time of a build.
std::uint32_t launched_rounds(std::uint32_t capacity) {
  constexpr std::uint32_t kMany = 3u << 18;
  if (capacity <= kPlocFew) return 0;
  const auto halvings = static_cast<std::uint32_t>(std::bit_width((capacity - 1) / kPlocFew));
  return (capacity < kMany ? 4 : 5) * halvings + 4;
}

/// Tiles of a round.
std::uint32_t most_tiles(std::uint32_t capacity, unsigned radius) {
  return capacity <= kPlocFew ? 0 : PlocTile<kPlocBlock, kPlocMostRadius>::tiles(capacity, radius);
}

/// The memory of a build.
void take_scratch(Arena& arena, std::uint32_t capacity, PlocJob& job) {
  job.even = arena.take<Cluster>(capacity);
  job.odd = arena.take<Cluster>(capacity);
  job.rounds = arena.take<PlocRound>(launched_rounds(capacity) + 1);
  job.words = arena.take<std::uint64_t>(most_tiles(capacity, kPlocMostRadius));
}

}  // namespace

std::uint64_t ploc_scratch(std::uint32_t capacity) {
  Arena arena;
  PlocJob job{};
  take_scratch(arena, capacity, job);
  return arena.size();
}

Result<void> enqueue_ploc(const PlocInput& input, const PlocOutput& output, std::byte* scratch, hipStream_t stream) {
  if (input.radius < 1 || input.radius > kPlocMostRadius)
    return fail(ErrorCode::kInvalidInput, "a PLOC radius of ", input.radius, ", allowed are 1 to ", kPlocMostRadius);
  if (input.capacity >= build::kLinkedLeaf)
    return fail(ErrorCode::kInvalidInput, "PLOC of ", input.capacity, " leaves, the limit is ", build::kLinkedLeaf - 1);
  PlocJob job{{{input.references}, output.nodes, {}, output.root}, nullptr, nullptr, nullptr, nullptr, input.radius};
  Arena arena(scratch);
  take_scratch(arena, input.capacity, job);
  const std::uint32_t rounds = launched_rounds(input.capacity), tiles = most_tiles(input.capacity, input.radius);
  Launcher steps(stream);
  const std::uint32_t first = std::max(tiles, rounds + 1);
  steps.each(first, "ploc_start", ploc_start, job, input.count, rounds, tiles);
  const auto round_kernel =
      input.radius <= kPlocSmallRadius ? ploc_round<kPlocSmallRadius> : ploc_round<kPlocMostRadius>;
  for (std::uint32_t round = 0; round < rounds; ++round)
    steps.persistent("ploc_round", kPlocBlock, tiles, round_kernel, job, round);
  steps.blocks("ploc_finish", kPlocLastBlock, 1, ploc_finish, job, rounds);
  return steps.result();
}

}  // namespace hiprt::gpu
