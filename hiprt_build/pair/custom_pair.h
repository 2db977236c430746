#pragma once
/// Decides which custom primitives share a leaf. Internal.

#include <hiprt_build/tree/box.h>

namespace hiprt::build {

/// Largest area of a custom pair's box, relative to the sum of its primitives': where both cost the same. Two single
/// leaves cost SahCosts::custom times the sum of their areas. A pair costs that times the area of the pair, and takes
/// one slot less of a node around it: with three leaves to a node a third of a box node, times at least that area. So
/// the pair wins while area * (custom - box_node / 3) < custom * sum, which is area < 1.29 * sum for the default costs.
inline constexpr float kCustomPairArea = 1.25f;

/// @pre both are kept (drop_reason()).
HIPRT_HD HIPRT_FORCE_INLINE bool share_leaf(const Box& a, const Box& b) {
  return half_area(unite(a, b)) <= kCustomPairArea * (half_area(a) + half_area(b));
}

}  // namespace hiprt::build
