#pragma once
/// The name of a variant of the traversal: one value per axis. cmake/HiprtBenchVariants.cmake lists the values.

#include <array>
#include <cstddef>
#include <string_view>

namespace hiprt::bench {

/// The values as on command lines and in JSON.
struct VariantName {
  std::string_view query;     ///< closest, any, all
  std::string_view layout;    ///< float, planes, half, quantized
  std::string_view tests;     ///< accurate: Watertight + Conservative, fast: Fast + Plain, hardware: both by hardware;
                              ///< TRIANGLES-BOXES: the other pairs, e.g. watertight-hardware
  std::string_view stack;     ///< private, tieredN (N entries in shared memory; tiered: 16), shared, rolling,
                              ///< rolling-pool, global, restart; -paths: the state per level of instances (PathMemory)
                              ///< is in shared memory, too
  std::string_view schedule;  ///< immediate, postponed, batchN, batchNvM: WholeWave<N, M> through trace_batch()
  std::string_view order;     ///< sorted: NearFirst, nearest: NearestFirst, stored: Unordered, tested: AsTested
  std::string_view features;  ///< triangles, splits, masks, filter, custom, custom-filter; placed: a scene that is one
                              ///< instance; levelsN: N levels of instances; movingN: the same with motion
  std::string_view blocks;    ///< 64x14: threads per block x least number of blocks per multiprocessor; CPU: 1x1
  std::string_view answers;   ///< id: rays of 32 bytes, results of 8; hit: as a program has them, Ray and Hit
};

/// Whether every result must equal the host's to the last bit. HardwareBoxes do not guarantee to find every hit
/// (docs/decisions/0008-amd-ray-instruction.md), but here a lost hit counts as wrong.
inline bool is_exact(const VariantName& name) {
  return name.tests == "accurate" || name.tests == "watertight-hardware";
}

/// Whether the child order is the library's default for the query (HardwarePolicies with HardwareBoxes). Tables call it
/// "usual", so that the queries of a variant share a row.
inline bool has_usual_order(const VariantName& name) {
  if (name.order == "tested") return true;
  // AllHits traverses like ClosestHit where primitives may be split.
  const bool any_order = name.query == "any" || (name.query == "all" && name.features == "triangles");
  return name.order == (any_order ? "stored" : "sorted");
}

/// An axis, for the command line and for JSON.
struct Axis {
  std::string_view flag;  ///< Without the two dashes.
  std::string_view key;   ///< In JSON.
  std::string_view VariantName::*value;
};
inline constexpr std::array<Axis, 9> kAxes{{
    {"queries", "query", &VariantName::query},
    {"layouts", "layout", &VariantName::layout},
    {"tests", "tests", &VariantName::tests},
    {"stacks", "stack", &VariantName::stack},
    {"schedules", "schedule", &VariantName::schedule},
    {"orders", "order", &VariantName::order},
    {"features", "features", &VariantName::features},
    {"blocks", "blocks", &VariantName::blocks},
    {"answers", "answers", &VariantName::answers},
}};

}  // namespace hiprt::bench
