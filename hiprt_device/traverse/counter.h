#pragma once
/// Counters: policies that count the work of a ray, or observe every step of it.

#include <hiprt_device/format/node.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Counts nothing, at no cost.
struct NoCounter {
  HIPRT_HD HIPRT_FORCE_INLINE void on_boxes() {}
  HIPRT_HD HIPRT_FORCE_INLINE void on_leaf(unsigned) {}
};

/// Counts tests of four boxes, leaf tests, tested triangles (one or two per leaf), and instances that a ray came to.
///
/// An instance counts even if the ray's mask hides it. An instance that moves counts if the ray comes to its box at
/// the ray's time.
struct WorkCounter {
  std::uint32_t box_tests = 0;
  std::uint32_t leaf_tests = 0;
  std::uint32_t triangle_tests = 0;
  std::uint32_t instance_tests = 0;
  HIPRT_HD HIPRT_FORCE_INLINE void on_boxes() { ++box_tests; }
  HIPRT_HD HIPRT_FORCE_INLINE void on_leaf(unsigned triangles) {
    ++leaf_tests;
    triangle_tests += triangles;
  }
  HIPRT_HD HIPRT_FORCE_INLINE void on_instance() { ++instance_tests; }
};

/// A visit to a box node, as observers see it.
struct NodeVisit {
  const std::byte* base;  ///< First byte of the file that has the node: the scene's, or an object's.
  NodeRef node;
  bool met[kBranching];     ///< The children whose boxes the ray meets.
  float enter[kBranching];  ///< t where the ray enters those boxes; at least tmin.
};

/// A counter that is called for every step of one ray, in order. For debugging and teaching. Box tests that sort
/// cannot have one.
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
