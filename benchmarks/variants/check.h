#pragma once
/// Whether results are right.

#include "input.h"
#include "ray_result.h"

#include <span>

namespace hiprt::bench {

/// Checksum over all results: t and id of closest hits, hit or miss of any hits, and the sums of all hits. Which any
/// hit is found depends on the tree.
std::uint64_t checksum(std::span<const RayResult> results, Query query);

/// Number of rays that hit something; for Query::kAll the number of hits of all rays.
std::uint64_t count_hits(std::span<const RayResult> results, Query query);

/// Results of the host's accurate tracer for about 2000 rays, spread evenly.
class HostResults {
 public:
  HostResults(const Tree& tree, std::span<const Ray> rays, Query query);

  struct Comparison {
    std::uint64_t checked = 0;
    std::uint64_t wrong = 0;             ///< Rays with a bit that differs, among those of checksum().
    std::uint64_t other_primitives = 0;  ///< Rays that hit other primitives, or a different number; t does not count.
  };
  /// @param results one per ray. Failed rays are not checked.
  Comparison compare(std::span<const RayResult> results) const;

 private:
  Query query_;
  std::size_t step_;
  std::vector<RayResult> results_;
};

}  // namespace hiprt::bench
