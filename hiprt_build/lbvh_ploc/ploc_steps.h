#pragma once
/// Clusters along a Morton curve that merge with the nearest in rounds (Meister and Bittner, "Parallel locally-ordered
/// clustering for bounding volume hierarchy construction", 2018; Benthin et al., "PLOC++", 2022). Internal.

#include <hiprt_build/lbvh_ploc/cluster.h>

namespace hiprt::build {

/// If a round joins fewer than one of so many clusters, the next round joins neighbours. Otherwise rows of boxes where
/// each is nearest to the one before would take a round per cluster.
inline constexpr std::uint32_t kPlocMinJoined = 32;
/// After so many rounds that look for the nearest, all rounds join neighbours. This limits rounds and tree levels to
/// this number plus ceil(log2(leaves)). Scenes need 60 to 110 rounds (30 thousand to 1.2 million leaves, radius 8).
/// Fewer rounds would cost much quality, because the last clusters make the top of the tree.
inline constexpr std::uint32_t kPlocMostLooks = 192;

/// What is known before a round.
struct PlocProgress {
  std::uint32_t count;       ///< Clusters.
  std::uint32_t rounds;      ///< That have been.
  std::uint32_t looks;       ///< Of these, how many looked for the nearest.
  std::uint32_t neighbours;  ///< 1: this round joins neighbours, 0: it looks.

  HIPRT_HD static PlocProgress start(std::uint32_t count) { return PlocProgress{count, 0, 0, 0}; }
  /// @param left clusters after the round.
  HIPRT_HD PlocProgress next(std::uint32_t left) const {
    const bool looked = neighbours == 0;
    const bool few = std::uint64_t{count - left} * kPlocMinJoined < count;
    const std::uint32_t looked_now = looks + (looked ? 1 : 0);
    return PlocProgress{left, rounds + 1, looked_now, (looked && few) || looked_now == kPlocMostLooks ? 1u : 0u};
  }
};

/// @return the position of the cluster nearest to the i-th of @p count, at most @p radius positions away.
/// @param box_at the box of the cluster at a position. @pre count > 1
template <class BoxAt>
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t ploc_nearest(std::uint32_t i, std::uint32_t count, std::uint32_t radius,
                                                       const BoxAt& box_at) {
  const Box box = box_at(i);
  const std::uint32_t begin = i > radius ? i - radius : 0;
  const std::uint32_t end = count - i > radius ? i + radius + 1 : count;
  std::uint64_t best = ~std::uint64_t{0};
  const auto look = [&](std::uint32_t j) HIPRT_FORCE_INLINE_LAMBDA {
    const std::uint64_t key = nearness(box, box_at(j), i, j);
    best = key < best ? key : best;
  };
  for (std::uint32_t j = begin; j < i; ++j) look(j);
  for (std::uint32_t j = i + 1; j < end; ++j) look(j);
  return i ^ static_cast<std::uint32_t>(best);
}

/// As ploc_nearest(), without looking: 0 and 1, 2 and 3, ...; the last of an odd number is nobody's neighbour.
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t ploc_neighbour(std::uint32_t i, std::uint32_t count) {
  const std::uint32_t other = i ^ 1u;
  return other < count ? other : i;
}

/// What becomes of a cluster in a round.
enum class PlocAction : std::uint32_t {
  kStays,
  kJoins,  ///< Becomes one with its nearest, which comes after it.
  kGoes,   ///< Its nearest, which comes before it, becomes one with it.
};

/// Of the i-th. @param nearest_of the position nearest to a position.
template <class NearestOf>
HIPRT_HD HIPRT_FORCE_INLINE PlocAction ploc_action(std::uint32_t i, const NearestOf& nearest_of) {
  const std::uint32_t j = nearest_of(i);
  if (j == i || nearest_of(j) != i) return PlocAction::kStays;
  return i < j ? PlocAction::kJoins : PlocAction::kGoes;
}

}  // namespace hiprt::build
