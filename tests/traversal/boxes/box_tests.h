#pragma once
/// The box test of each policy, layout and lanes, as values for loops.

#include <hiprt_device/ray.h>

#include <limits>
#include <span>

namespace hiprt::checks {

/// A node's boxes; the empty one where there is no child.
struct NodeBoxes {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr Box kEmpty{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};

  Box child[kBranching] = {kEmpty, kEmpty, kEmpty, kEmpty};
};

struct NamedBoxTest {
  const char* name;
  bool conservative;
  /// The boxes as a node of the layout stores them. Infinite planes stand for the scene's bounds.
  /// @return false: it cannot hold them.
  bool (*round)(NodeBoxes& boxes);
  /// @param boxes put into a node, which can hold them. @param bounds of the scene, around the boxes.
  /// @return bit per child: it passes.
  std::uint32_t (*passing)(const Ray& ray, const NodeBoxes& boxes, const Box& bounds);
};

std::span<const NamedBoxTest> box_tests();

}  // namespace hiprt::checks
