#pragma once
/// Whether answers are right.

#include "answer.h"
#include "input.h"

#include <span>

namespace hiprt::bench {

/// Over all answers: t and id of closest hits, hit or miss of any hits (which hit it is depends on the tree).
std::uint64_t checksum(std::span<const Answer> answers, bool any_hit);

/// What the host's accurate tracer says of about 2000 rays, spread evenly.
class HostAnswers {
 public:
  HostAnswers(const Tree& tree, std::span<const Ray> rays, bool any_hit);

  struct Comparison {
    std::uint64_t checked = 0, wrong = 0;
  };
  /// @param answers one per ray. Failed ones are not checked.
  Comparison compare(std::span<const Answer> answers) const;

 private:
  bool any_hit_;
  std::size_t step_;
  std::vector<Answer> answers_;
};

}  // namespace hiprt::bench
