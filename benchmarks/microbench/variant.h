#pragma once
/// What a variant of the traversal is called: one value on each axis. The values: cmake/HiprtBenchVariants.cmake.

#include <array>
#include <cstddef>
#include <string_view>

namespace hiprt::bench {

/// Names as on command lines and in JSON.
struct VariantName {
  std::string_view query;     ///< closest, any
  std::string_view layout;    ///< float, planes, half, quantized
  std::string_view tests;     ///< accurate: Watertight + Conservative, fast: Fast + Plain
  std::string_view stack;     ///< private, shared, rolling, rolling-pool, global, restart
  std::string_view schedule;  ///< immediate, postponed, batchN: WholeWave<N> through trace_batch()
  std::string_view order;     ///< sorted: NearFirst, nearest: NearestFirst, stored: Unordered
  std::string_view features;  ///< triangles, splits, masks, filter, custom
  std::string_view blocks;    ///< 64x14: threads of a block x least blocks of a multiprocessor; CPU: 1x1
};

/// An axis, for the command line and for JSON.
struct Axis {
  std::string_view flag;  ///< Without the two dashes.
  std::string_view key;   ///< In JSON.
  std::string_view VariantName::*value;
};
inline constexpr std::array<Axis, 8> kAxes{{
    {"queries", "query", &VariantName::query},
    {"layouts", "layout", &VariantName::layout},
    {"tests", "tests", &VariantName::tests},
    {"stacks", "stack", &VariantName::stack},
    {"schedules", "schedule", &VariantName::schedule},
    {"orders", "order", &VariantName::order},
    {"features", "features", &VariantName::features},
    {"blocks", "blocks", &VariantName::blocks},
}};

}  // namespace hiprt::bench
