#pragma once
/// Decides which custom primitives share a leaf. Internal.

#include <hiprt_build/tree/box.h>

namespace hiprt::build {

/// Largest area of a custom pair's box, relative to the sum of the areas of its primitives.
/// Two single leaves cost SahCosts::custom times the sum of their areas. A pair costs SahCosts::custom times its area,
/// and saves one slot of the node above. With three leaves per node a slot costs a third of a box node, times the area.
/// So the pair wins while area * (custom - box_node / 3) < custom * sum: area < 1.29 * sum for the default costs.
inline constexpr float kCustomPairArea = 1.25f;

/// @pre both are kept (drop_reason()).
HIPRT_HD HIPRT_FORCE_INLINE bool share_leaf(const Box& a, const Box& b) {
  return half_area(unite(a, b)) <= kCustomPairArea * (half_area(a) + half_area(b));
}

}  // namespace hiprt::build
