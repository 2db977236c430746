#pragma once
/// Traces batches of rays on the CPU, with policies chosen at run time and the machine's best instruction set.
/// trace_kernels*.cpp compile the traversal once per instruction set.

#include <hiprt_build/format/view.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>
#include <hiprt_device/traverse/counter.h>

#include <cstdint>
#include <span>

namespace hiprt::tools {

struct PathScene;

enum class Query { kClosest, kAny };
enum class TriangleTestKind { kWatertight, kFast, kReference };
enum class BoxTestKind { kConservative, kPlain };

/// @invariant kReference goes with conservative boxes.
struct TracePolicies {
  TriangleTestKind triangle_test = TriangleTestKind::kWatertight;
  BoxTestKind box_test = BoxTestKind::kConservative;

  friend bool operator==(const TracePolicies&, const TracePolicies&) = default;
};

/// Work of one ray: tests of four boxes, tests of leaves, triangles in those leaves (one or two each), instances that
/// the ray entered.
struct RayCost {
  std::uint32_t box_tests = 0;
  std::uint32_t leaf_tests = 0;
  std::uint32_t triangle_tests = 0;
  std::uint32_t instance_tests = 0;
};

/// One of a tracer's steps (TraversalObserver).
struct TraceStep {
  enum class Kind {
    kNode,       ///< It tested the boxes of visit.node's children.
    kLeaf,       ///< It looked into visit.node, a leaf.
    kCandidate,  ///< The line meets the leaf's primitive `number` (0 or 1) at t.
    kEnter,      ///< It went into the leaf's instance `number`, of the file that has the leaf.
    kExit        ///< It came out of that again.
  };
  Kind kind;
  NodeVisit visit;
  std::uint32_t number;
  float t;
};

/// Receiver of the steps.
struct StepSink {
  void (*take)(void* to, const TraceStep& step) = nullptr;
  void* to = nullptr;
};

/// Traces rays[i] into hits[i] on the calling thread, by the smallest tracer that covers the scene. Of scenes that
/// check_traceable() (bvh_file.h) refuses all hits are Hit::failed(). Of scenes with spheres and curves @p policies
/// choose between kReference and the default ones only.
/// @param hits as many as rays. Query::kAny: some hit of the ray, without normal and error.
/// @param costs empty, or as many as rays: then the work is counted (a separately compiled variant).
/// @param paths empty, or scene.levels entries per ray: the instance paths of the hits (instance_paths.h).
void trace(const SceneView& scene, Query query, const TracePolicies& policies, std::span<const Ray> rays,
           std::span<Hit> hits, std::span<RayCost> costs = {}, std::span<std::uint32_t> paths = {});

/// The same with the default policies. Rays pass through the parts of triangles that materials cut out (AlphaCutout).
void trace(const PathScene& scene, Query query, std::span<const Ray> rays, std::span<Hit> hits,
           std::span<std::uint32_t> paths = {});

/// The same for one ray, step by step.
void trace_steps(const SceneView& scene, Query query, const TracePolicies& policies, const Ray& ray, Hit& hit,
                 RayCost& cost, std::span<std::uint32_t> path, const StepSink& sink);

/// Name of the instruction set that trace() uses on this machine, e.g. "x86_64_v3".
const char* trace_isa();

}  // namespace hiprt::tools
