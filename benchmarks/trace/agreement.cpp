#include "agreement.h"

#include <algorithm>
#include <cmath>

namespace hiprt::bench {

std::uint64_t count_disagreements(std::span<const Hit> hits, std::span<const Hit> reference, bool any_hit,
                                  float reach) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit &a = hits[i], &b = reference[i];
    const bool both = a.found() && b.found();
    const float tolerance = kRelativeTolerance * std::max(a.t, b.t) + kAbsoluteTolerance * reach;
    const bool differ = a.failed() || a.found() != b.found() || (both && !any_hit && std::abs(a.t - b.t) > tolerance);
    count += differ ? 1 : 0;
  }
  return count;
}

std::uint64_t count_inexact(std::span<const Hit> hits, std::span<const Hit> reference, bool any_hit) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit &a = hits[i], &b = reference[i];
    const bool same_values =
        a.t == b.t && a.u == b.u && a.v == b.v && a.geometry == b.geometry && a.primitive == b.primitive;
    count += a.found() != b.found() || (!any_hit && !same_values) ? 1 : 0;
  }
  return count;
}

std::uint64_t count_other_primitives(std::span<const Hit> hits, std::span<const Hit> reference) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit &a = hits[i], &b = reference[i];
    const bool same = a.geometry == b.geometry && a.primitive == b.primitive;
    count += a.found() && b.found() && !same ? 1 : 0;
  }
  return count;
}

}  // namespace hiprt::bench
