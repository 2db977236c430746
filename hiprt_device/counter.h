#pragma once
/// Counting the work of a ray: a policy that costs nothing when it is off.

#include <hiprt_device/format/portability.h>

#include <cstdint>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Counts nothing, at no cost.
struct NoCounter {
  HIPRT_HD HIPRT_INLINE void on_boxes() {}
  HIPRT_HD HIPRT_INLINE void on_leaf(unsigned) {}
};

/// Counts four-box tests, leaf tests, the triangles (one or two per leaf) in those, and the instances that a ray came
/// to, seen by it or not.
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

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
