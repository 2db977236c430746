#pragma once
/// Makes leaves of one or two primitives. Internal.
///
/// Two triangles of one mesh may share a leaf if they have a common edge. Its ends have the same positions, and the
/// triangles run through it in opposite directions. Each triangle looks at its three neighbours, wherever they are in
/// the index buffer. It prefers the neighbour whose common box saves the most area. Two triangles that prefer each
/// other become a pair. A few rounds of this (handshake matching) leave few triangles single. Triangles whose numbers
/// differ by more than LeafContents::kMaxDistance are never paired. The result does not depend on the number of
/// threads.
///
/// Custom primitives 2 i and 2 i + 1 of a geometry share a leaf if they are close enough. Neighbours in the program's
/// order (segments of a hair, points of a sorted cloud) are usually neighbours in space.

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/input/build_input.h>
#include <hiprt_build/input/leaf.h>

namespace hiprt::build {

/// The leaves of a build.
struct PairedPrimitives {
  /// Only the first `count` are used. They are in the order of their lower primitives.
  ScratchArray<LeafPrimitives> leaves;
  std::size_t count = 0;
  std::size_t custom_count = 0;  ///< So many of the last leaves hold custom primitives.
  std::uint64_t pairs = 0, custom_pairs = 0;
  std::uint64_t dropped_not_finite = 0, dropped_degenerate = 0;
  std::vector<std::uint64_t> dropped;  ///< Per geometry.
};

/// @param pair false: every leaf holds one primitive.
/// @param home one number per primitive of all geometries: only primitives with the same number share a leaf. Empty:
/// any two may.
PairedPrimitives pair_primitives(CpuEngine& engine, const BuildInput& input, bool pair,
                                 std::span<const std::uint32_t> home = {});

}  // namespace hiprt::build
