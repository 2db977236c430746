#include "agreement.h"

#include <algorithm>
#include <cmath>

namespace hiprt::bench {

std::uint64_t count_disagreements(std::span<const Hit> hits, std::span<const Hit> reference, bool any_hit,
                                  float reach) {
  const Disagreements all = find_disagreements({hits, {}}, {reference, {}}, any_hit, reach);
  return all.found + all.distance;
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

Disagreements find_disagreements(const HitList& list, const HitList& reference, bool any_hit, float reach) {
  Disagreements count;
  const bool instances = !list.instances.empty() && !reference.instances.empty();
  for (std::size_t i = 0; i < list.hits.size(); ++i) {
    const Hit &a = list.hits[i], &b = reference.hits[i];
    const float tolerance = kRelativeTolerance * std::max(a.t, b.t) + kAbsoluteTolerance * reach;
    if (a.failed() || a.found() != b.found())
      ++count.found;
    else if (any_hit || !a.found())
      continue;
    else if (std::abs(a.t - b.t) > tolerance)
      ++count.distance;
    else if (instances && list.instances[i] != reference.instances[i])
      ++count.instance;
    else if (a.geometry != b.geometry || a.primitive != b.primitive)
      ++count.primitive;
  }
  return count;
}

}  // namespace hiprt::bench
