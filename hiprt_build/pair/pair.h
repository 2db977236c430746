#pragma once
/// Makes leaves of one or two primitives. Internal.
///
/// Triangles of one mesh whose corners touch at the same positions and that run through their common edge in opposite
/// directions may share a leaf. Each triangle looks at its three neighbours wherever they are in the index buffer,
/// prefers the one whose common box saves most area. Two that prefer each other pair up. A few rounds of this
/// (handshake matching) leave few triangles single. Triangles whose numbers differ by more than
/// LeafContents::kMaxDistance stay single. The result does not depend on the number of threads.
///
/// Custom primitives 2 i and 2 i + 1 of a geometry share a leaf if they are close enough: neighbours in the program's
/// order (segments of a hair, points of a sorted cloud) are usually neighbours in space.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/build_input.h>
#include <hiprt_build/input/leaf.h>

namespace hiprt::build {

/// The leaves of a build.
struct PairedPrimitives {
  /// The first count ones are used; in the order of their lower primitives.
  ScratchArray<LeafPrimitives> leaves;
  std::size_t count = 0;
  std::size_t custom_count = 0;  ///< The last ones hold custom primitives.
  std::uint64_t pairs = 0, custom_pairs = 0;
  std::uint64_t dropped_not_finite = 0, dropped_degenerate = 0;
  std::vector<std::uint64_t> dropped;  ///< Per geometry.
};

/// @param pair false: every primitive alone.
/// @param home one number per primitive of all geometries: only primitives with the same number share a leaf. Empty:
/// all may.
PairedPrimitives pair_primitives(CpuEngine& engine, const BuildInput& input, bool pair,
                                 std::span<const std::uint32_t> home = {});

}  // namespace hiprt::build
