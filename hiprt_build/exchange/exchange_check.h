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

/// A triangle that is in several leaves, and one of these leaves.
struct SharedTriangle {
  std::uint32_t primitive, leaf;

  friend bool operator<(const SharedTriangle& a, const SharedTriangle& b) {
    return a.primitive != b.primitive ? a.primitive < b.primitive : a.leaf < b.leaf;
  }
};

struct CheckedTree {
  /// A bit of `home`: the other bits are not a leaf, but a primitive that is in the same leaves.
  static constexpr std::uint32_t kShared = 0x80000000u;

  ScratchArray<std::uint32_t> order;  ///< All nodes, parents before their children.
  /// One value per primitive. It is the number of the primitive's leaf, or kInvalidId if the primitive is dropped.
  /// Primitives that are in the same several leaves have one value, kShared with the number of one of them. A custom
  /// primitive in several leaves goes to the leaf whose box it enlarges least; of equal leaves the lower one. It is not
  /// split, because its shape inside a part of its box is unknown.
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
