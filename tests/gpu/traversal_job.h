#pragma once
/// Input and output of the traversal test's kernels, and the table of kernels.

#include <hiprt_build/gpu/hip.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/primitives/primitive_table.h>
#include <hiprt_device/primitives/round_curve.h>
#include <hiprt_device/primitives/sphere.h>
#include <hiprt_device/traverse/stacks/rolling.h>

#include <span>

namespace hiprt::checks {

/// Threads of every block.
inline constexpr unsigned kBlock = 64;
/// Entries before and behind every stack memory, and what they hold.
inline constexpr unsigned kGuard = 64;
inline constexpr StackEntry kGuardEntry = 0xfeedfeedfeedfeedu;

/// The result of a query for one ray.
struct QueryResult {
  Hit hit;               ///< The first.
  TraversalState state;  ///< After the last call.
  std::uint32_t failed;  ///< Whether the last result reports a failure.
  std::uint32_t count;   ///< Hits found: of all, or of the first kDepth.
  std::uint64_t digest;  ///< Of those hits, in any order.
};

/// Hits per ray that the test takes from a closest-hit query, in order.
inline constexpr unsigned kDepth = 3;

HIPRT_HD inline std::uint64_t mix(std::uint64_t state, std::uint32_t bits) {
  state = (state ^ bits) * 0x9e3779b97f4a7c15u;
  return state ^ state >> 29;
}
HIPRT_HD inline std::uint64_t digest_of(const Hit& hit) {
  const float values[] = {hit.t, hit.u, hit.v, hit.normal.x, hit.normal.y, hit.normal.z, hit.error};
  std::uint64_t state = mix(mix(1, hit.geometry), hit.primitive);
  for (const float value : values) state = mix(state, std::bit_cast<std::uint32_t>(value));
  return state;
}

struct AcceptAll {
  HIPRT_HD FilterResult operator()(const Ray&, const Hit&) const { return FilterResult::kAccept; }
};
/// Asks for all that a filter may ask in a scene without instances.
struct RejectSome {
  template <class Questions>
  HIPRT_HD FilterResult operator()(const Ray&, const Hit& hit, const Questions& questions) const {
    const bool reject = questions.is_front() ? hit.primitive % 3 == 0 : questions.normal().x > 0.0f;
    return reject && questions.depth() == 0 ? FilterResult::kReject : FilterResult::kAccept;
  }
};
struct StopAtOnce {
  HIPRT_HD FilterResult operator()(const Ray&, const Hit&) const { return FilterResult::kAcceptAndStop; }
};

/// Types 0 and 1.
using Customs = PrimitiveList<SphereSet, RoundCurveSet>;

/// The argument of every kernel. All pointers are the device's.
struct Job {
  SceneView scene;
  const Ray* rays;
  QueryResult* results;
  std::uint32_t count;           ///< Rays.
  std::uint32_t* next;           ///< For batches; 0 at first.
  std::uint32_t* failed_rays;    ///< Counted by the stacks; 0 at first.
  std::uint32_t* broken_guards;  ///< Threads that saw guard words of shared or private memory overwritten.
  StackEntry* spill;             ///< spill_entries for each thread of the grid.
  std::uint32_t spill_entries;
  SpillPool pool;
  Customs customs;
};

enum class Query { kClosest, kAny, kAll };
enum class Filtering { kNone, kReject, kStop };

/// A kernel under test.
struct Variant {
  const char* name;
  void (*kernel)(Job);
  NodeLayout layout;
  Query query;
  Filtering filter;
  unsigned depth;     ///< Hits that the test takes from a query.
  bool batch;         ///< The grid may have fewer threads than there are rays.
  bool custom;        ///< It can trace Customs.
  bool exact = true;  ///< Hits have the host's bits.
};

/// Grouped by the axis whose values are all tried, with the defaults of the other axes.
std::span<const Variant> layout_variants();
std::span<const Variant> default_call_variants();
std::span<const Variant> stack_variants();
std::span<const Variant> schedule_variants();
std::span<const Variant> query_variants();
std::span<const Variant> filter_variants();
std::span<const Variant> mixed_variants();
std::span<const Variant> custom_variants();
/// With AMD's ray instruction: they do nothing on GPUs without it.
std::span<const Variant> hardware_variants();
/// Stacks too small for most rays.
std::span<const Variant> tiny_stack_variants();
/// A restart trail, whose capacity is the depth of the tree.
std::span<const Variant> restart_variants();

}  // namespace hiprt::checks
