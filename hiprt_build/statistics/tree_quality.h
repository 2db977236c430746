#pragma once
/// The quality of a whole tree on the CPU. Internal.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/statistics/tree_quality_steps.h>

#include <algorithm>
#include <span>
#include <vector>

namespace hiprt::build {

/// @param nodes in the file. @return their sums, the same with any number of threads.
/// @param parts memory for one sum per chunk of nodes: CpuEngine::chunk_count(nodes).
template <class Layout>
QualitySums sum_quality(CpuEngine& engine, const TreeQuality<Layout>& quality, std::size_t nodes,
                        std::span<QualitySums> parts) {
  std::fill(parts.begin(), parts.end(), QualitySums{});
  engine.for_chunks(nodes, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) parts[chunk].add(quality(i));
  });
  QualitySums sums;
  for (const QualitySums& part : parts) sums.add(part);
  return sums;
}

/// Allocates the memory for the parts.
template <class Layout>
QualitySums sum_quality(CpuEngine& engine, const TreeQuality<Layout>& quality, std::size_t nodes) {
  std::vector<QualitySums> parts(CpuEngine::chunk_count(nodes));
  return sum_quality(engine, quality, nodes, std::span(parts));
}

}  // namespace hiprt::build
