#pragma once
/// The box test under each policy, layout and lanes, as values that a test can loop over.

#include <hiprt_device/ray.h>

#include <span>

namespace hiprt::checks {

struct BoxAnswer {
  bool kept;    ///< The child passes.
  bool absent;  ///< Some absent child passes: an invalid reference would be followed.
};

struct NamedBoxTest {
  const char* name;
  bool conservative;
  /// Puts the box into one child of a node whose other children are absent. @param bounds of the scene, around the box.
  BoxAnswer (*keeps)(const Ray& ray, const Box& box, unsigned child, const Box& bounds);
};

std::span<const NamedBoxTest> box_tests();

}  // namespace hiprt::checks
