#pragma once
/// What a variant of the traversal is called: one value on each axis. The values: cmake/HiprtBenchVariants.cmake.

#include <array>
#include <cstddef>
#include <string_view>

namespace hiprt::bench {

/// Names as on command lines and in JSON.
struct VariantName {
  std::string_view query;     ///< closest, any, all
  std::string_view layout;    ///< float, planes, half, quantized
  std::string_view tests;     ///< accurate: Watertight + Conservative, fast: Fast + Plain, hardware: both hardware's;
                              ///< TRIANGLES-BOXES: the other pairs, e.g. watertight-hardware
  std::string_view stack;     ///< private, tieredN (N entries in shared memory; tiered: 16), shared, rolling,
                              ///< rolling-pool, global, restart; with -ways: of instances too, in shared memory
  std::string_view schedule;  ///< immediate, postponed, batchN, batchNvM: WholeWave<N, M> through trace_batch()
  std::string_view order;     ///< sorted: NearFirst, nearest: NearestFirst, stored: Unordered, tested: AsTested
  std::string_view features;  ///< triangles, splits, masks, filter, custom, custom-filter, placed: a scene
                              ///< that is one instance, levelsN: with that many
                              ///< levels of instances; movingN: which may move
  std::string_view blocks;    ///< 64x14: threads of a block x least blocks of a multiprocessor; CPU: 1x1
};

/// Whether every answer must have the bits of the host's. HardwareBoxes are no excuse for a lost hit, though they do
/// not guarantee to find all (docs/decisions/0008-amd-ray-instruction.md).
inline bool is_exact(const VariantName& name) {
  return name.tests == "accurate" || name.tests == "watertight-hardware";
}

/// The order that the library takes for such a query (HardwarePolicies with HardwareBoxes). For names, where "usual"
/// stands for it: so the queries of a variant share a row.
inline bool has_usual_order(const VariantName& name) {
  if (name.order == "tested") return true;
  // AllHits asks like ClosestHit where primitives may be split.
  const bool any_order = name.query == "any" || (name.query == "all" && name.features == "triangles");
  return name.order == (any_order ? "stored" : "sorted");
}

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
