#pragma once
/// Counting the work of a ray, or seeing all of it: a policy that costs nothing when it is off.

#include <hiprt_device/format/node.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Counts nothing, at no cost.
struct NoCounter {
  HIPRT_HD HIPRT_INLINE void on_boxes() {}
  HIPRT_HD HIPRT_INLINE void on_leaf(unsigned) {}
};

/// Counts four-box tests, leaf tests, the triangles (one or two per leaf) in those, and the instances that a ray came
/// to (those that move: about where they are at its time), seen by it or not.
struct WorkCounter {
  std::uint32_t box_tests = 0;
  std::uint32_t leaf_tests = 0;
  std::uint32_t triangle_tests = 0;
  std::uint32_t instance_tests = 0;
  HIPRT_HD HIPRT_INLINE void on_boxes() { ++box_tests; }
  HIPRT_HD HIPRT_INLINE void on_leaf(unsigned triangles) {
    ++leaf_tests;
    triangle_tests += triangles;
  }
  HIPRT_HD HIPRT_INLINE void on_instance() { ++instance_tests; }
};

/// A visit to a box node, as observers see it.
struct NodeVisit {
  const std::byte* base;  ///< The file that has it, the scene's or that of an object in it: its first byte.
  NodeRef node;
  bool met[kBranching];     ///< The children whose boxes the ray meets.
  float enter[kBranching];  ///< Where it enters those; at least tmin.
};

/// A counter that is told of every step, in their order: where one ray goes, for debugging and teaching. Not with box
/// tests that sort.
template <class T>
concept TraversalObserver = requires(T observer, const NodeVisit& visit, const std::byte* base, NodeRef leaf) {
  observer.on_node(visit);
  observer.on_leaf_at(base, leaf);  // its triangles, custom primitives or instance come next
  observer.on_candidate(0u, 0.0f);  // the line meets the leaf's primitive 0 or 1 at t, inside the ray's range or not
  observer.on_enter(0u);            // the leaf's instance, by number; not if the ray does not see it
  observer.on_exit();               // of the instance that was entered last
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
