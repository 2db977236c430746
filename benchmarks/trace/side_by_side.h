#pragma once
/// One scene and one kind of rays, traced by all tracers in turn.

#include "trace_scene.h"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace hiprt::bench {

/// Measurements of one tracer.
struct Entry {
  std::string name;
  double mrays_s = 0;  ///< Median over the rounds, 10^6 rays per second of one thread.
  double ratio = 0;    ///< Median over the rounds of the speed relative to embree_robust.
  double box_tests = std::numeric_limits<double>::quiet_NaN();   ///< Per ray; NaN: not counted.
  double leaf_tests = std::numeric_limits<double>::quiet_NaN();  ///< Per ray; NaN: not counted.
  std::uint64_t disagreements = 0;                               ///< Rays that differ from embree_robust.
};

struct Cell {
  std::string scene, kind;
  bool any_hit = false;
  std::size_t rays = 0;
  std::vector<Entry> entries;  ///< those of entry_names().
  std::vector<std::string> faults;

  const Entry& entry(std::string_view name) const;
};

/// Names of all entries, in their order.
std::vector<std::string> entry_names();

/// @param rounds at least 1. Before them every tracer traces the rays once, untimed.
/// @param most_disagreements largest fraction of rays on which an accurate tracer may disagree with embree_robust. More
///        is a fault, and so is any different bit between accurate tracers.
Cell measure(const TraceScene& scene, const RaySet& rays, unsigned rounds, double most_disagreements);

}  // namespace hiprt::bench
