#pragma once
/// Whether answers are right.

#include "answer.h"
#include "input.h"

#include <span>

namespace hiprt::bench {

/// Over all answers: t and id of closest hits, hit or miss of any hits (which hit it is depends on the tree), and the
/// sums of all hits.
std::uint64_t checksum(std::span<const Answer> answers, Query query);

/// Rays that hit something; of Query::kAll the hits of all rays.
std::uint64_t count_hits(std::span<const Answer> answers, Query query);

/// What the host's accurate tracer says of about 2000 rays, spread evenly.
class HostAnswers {
 public:
  HostAnswers(const Tree& tree, std::span<const Ray> rays, Query query);

  struct Comparison {
    std::uint64_t checked = 0;
    std::uint64_t wrong = 0;             ///< Any bit that checksum() sees differs.
    std::uint64_t other_primitives = 0;  ///< Hits other primitives, or more or fewer of them, or none; t is not judged.
  };
  /// @param answers one per ray. Failed ones are not checked.
  Comparison compare(std::span<const Answer> answers) const;

 private:
  Query query_;
  std::size_t step_;
  std::vector<Answer> answers_;
};

}  // namespace hiprt::bench
