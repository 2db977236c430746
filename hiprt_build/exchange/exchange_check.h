#pragma once
/// Checks a tree of unknown origin before it is imported. Internal.

#include <hiprt_build/error.h>
#include <hiprt_build/exchange.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/build_input.h>

#include <algorithm>
#include <span>
#include <vector>

namespace hiprt::build {

/// A triangle of several leaves, and one of the leaves.
struct SharedTriangle {
  std::uint32_t primitive, leaf;

  friend bool operator<(const SharedTriangle& a, const SharedTriangle& b) {
    return a.primitive != b.primitive ? a.primitive < b.primitive : a.leaf < b.leaf;
  }
};

struct CheckedTree {
  /// Of a home: the number of a primitive that is in the same several leaves.
  static constexpr std::uint32_t kShared = 0x80000000u;

  ScratchArray<std::uint32_t> order;  ///< All nodes, parents before their children.
  /// Per primitive: its leaf; or kShared and a primitive, the same one for all that are in the same leaves; kInvalidId
  /// for dropped ones. Of a custom primitive in several leaves the one whose box it enlarges least, then the lower
  /// node: its shape in a part of its box is unknown.
  ScratchArray<std::uint32_t> home;
  std::vector<SharedTriangle> shared;  ///< Sorted.

  std::span<const SharedTriangle> leaves_of(std::uint32_t primitive) const {
    const auto begin = std::lower_bound(shared.begin(), shared.end(), SharedTriangle{primitive, 0});
    const auto end = std::lower_bound(begin, shared.end(), SharedTriangle{primitive + 1, 0});
    return {begin, end};
  }
};

/// @pre check_sizes() and check_indices() accepted the scene.
/// @return the errors of validate(const ExchangeBvh&, const SceneInput&).
Result<CheckedTree> check_tree(CpuEngine& engine, const ExchangeBvh& tree, const BuildInput& input);

}  // namespace hiprt::build
