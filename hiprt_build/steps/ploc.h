#pragma once
/// Clusters along a Morton curve that merge with the nearest in rounds (Meister and Bittner, "Parallel locally-ordered
/// clustering for bounding volume hierarchy construction", 2018; Benthin et al., "PLOC++", 2022). Internal.

#include <hiprt_build/steps/cluster.h>

namespace hiprt::build {

/// A round that joins fewer than one of so many clusters is followed by one that joins neighbours: rows of boxes where
/// each is nearest to the one before would take a round per cluster.
inline constexpr std::uint32_t kPlocFewJoined = 32;

/// Step: the place of the cluster nearest to the i-th, at most @p radius places away.
struct PlocNearestStep {
  std::span<const Cluster> clusters;
  std::span<std::uint32_t> nearest;
  std::uint32_t radius;

  HIPRT_HD void operator()(std::size_t i) const {
    const auto mine = static_cast<std::uint32_t>(i), count = static_cast<std::uint32_t>(clusters.size());
    const Box box = clusters[i].box;
    const std::uint32_t begin = mine > radius ? mine - radius : 0;
    const std::uint32_t end = count - mine > radius ? mine + radius + 1 : count;
    std::uint64_t best = ~std::uint64_t{0};
    for (std::uint32_t j = begin; j < end; ++j) {
      if (j == mine) continue;
      const std::uint64_t key = nearness(box, clusters[j].box, mine, j);
      best = key < best ? key : best;
    }
    nearest[i] = mine ^ static_cast<std::uint32_t>(best);
  }
};

/// Step: as PlocNearestStep, without looking: 0 and 1, 2 and 3, ...
struct PlocNeighbourStep {
  std::span<std::uint32_t> nearest;

  HIPRT_HD void operator()(std::size_t i) const {
    const auto other = static_cast<std::uint32_t>(i ^ 1u);
    // The last of an odd number is nobody's neighbour.
    nearest[i] = other < nearest.size() ? other : static_cast<std::uint32_t>(i);
  }
};

/// What becomes of the i-th cluster once the nearest are known.
template <class Tree> struct PlocJoin {
  Tree tree;
  std::span<const Cluster> clusters;
  std::span<const std::uint32_t> nearest;

  /// Whether it is there in the next round, joined or not.
  HIPRT_HD bool stays(std::uint32_t i) const {
    const std::uint32_t j = nearest[i];
    return nearest[j] != i || j >= i;
  }
  /// The cluster of the next round. @pre stays(i)
  HIPRT_HD Cluster next(std::uint32_t i) const {
    const std::uint32_t j = nearest[i];
    return nearest[j] != i || j == i ? clusters[i] : join(tree, clusters[i], clusters[j]);
  }
};

}  // namespace hiprt::build
