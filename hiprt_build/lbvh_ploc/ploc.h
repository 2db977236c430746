#pragma once
/// Locally-ordered clustering of sorted leaves on the host. Internal.

#include <hiprt_build/lbvh_ploc/ploc_steps.h>

#include <utility>
#include <vector>

namespace hiprt::build {

/// One round. @return how many clusters are left; they are in @p to.
template <class Engine, class Tree>
std::uint32_t ploc_round(Engine& engine, const Tree& tree, std::span<const Cluster> clusters,
                         std::span<const std::uint32_t> nearest, std::span<Cluster> to) {
  const auto action = [&](std::size_t i) {
    return ploc_action(static_cast<std::uint32_t>(i), [&](std::uint32_t index) { return nearest[index]; });
  };
  std::vector<std::uint32_t> first(Engine::chunk_count(clusters.size()));
  engine.for_chunks(clusters.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::uint32_t staying = 0;
    for (std::size_t i = begin; i < end; ++i) staying += action(i) != PlocAction::kGoes ? 1 : 0;
    first[chunk] = staying;
  });
  const std::uint32_t left = engine.exclusive_scan(std::span<std::uint32_t>(first));
  engine.for_chunks(clusters.size(), [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    std::size_t index = first[chunk];
    for (std::size_t i = begin; i < end; ++i) {
      const PlocAction mine = action(i);
      if (mine == PlocAction::kGoes) continue;
      to[index++] = mine == PlocAction::kJoins ? join(tree, clusters[i], clusters[nearest[i]]) : clusters[i];
    }
  });
  return left;
}

/// @param tree a LinkedTree of @p count leaves in the order of their Morton codes. @param radius 1 or more.
/// @pre count > 0
template <class Engine, class Tree>
void emit_ploc(Engine& engine, const Tree& tree, std::size_t count, std::uint32_t radius) {
  auto clusters = engine.template allocate<Cluster>(count), spare = engine.template allocate<Cluster>(count);
  auto nearest = engine.template allocate<std::uint32_t>(count);
  engine.for_each(count, [&](std::size_t i) {
    const auto leaf = static_cast<std::uint32_t>(i);
    clusters[i] = leaf_cluster(tree.leaves.box(leaf), leaf);
  });
  for (auto progress = PlocProgress::start(static_cast<std::uint32_t>(count)); progress.count > 1;) {
    const auto box_at = [&](std::uint32_t i) HIPRT_FORCE_INLINE_LAMBDA -> const Box& { return clusters[i].box; };
    engine.for_each(progress.count, [&](std::size_t i) {
      const auto index = static_cast<std::uint32_t>(i);
      nearest[i] = progress.neighbours != 0 ? ploc_neighbour(index, progress.count)
                                            : ploc_nearest(index, progress.count, radius, box_at);
    });
    progress = progress.next(ploc_round(engine, tree, clusters.span().first(progress.count),
                                        nearest.span().first(progress.count), spare.span()));
    std::swap(clusters, spare);
  }
  *tree.root = clusters[0].ref;
}

}  // namespace hiprt::build
