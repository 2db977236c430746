#pragma once
/// BVH files whose primitives have moved: new boxes for the old tree, several times faster than a build.
///
///     auto moved = hiprt::build::refit(bvh->buffer.bytes(), {.meshes = meshes});
///     if (moved && moved->rebuild_advised) bvh = hiprt::build::build(meshes);

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt::build {

/// Threads of a refit, and when it advises a rebuild.
struct RefitOptions {
  /// 0, or more than there are: all that the process may use. The result does not depend on it.
  unsigned threads = 0;
  /// At least 0: a rebuild is advised when the exchange slack (statistics.h) has grown by more than this since the
  /// build. 0.05: when a fresh tree would save half of a ray's work or more (decision 0012).
  double rebuild_slack = 0.05;
  /// At least 1: for trees with split references, which exchanges do not see through, a rebuild is advised also when
  /// the SAH cost has grown by more than this factor.
  double rebuild_ratio = 1.5;
  ProgressCallback progress{};
};

/// "Built" is the tree as it was built, however often it was refitted since: from the file's provenance; without one,
/// of the tree before this refit.
struct RefitStatistics {
  std::uint64_t nodes = 0, leaves = 0;      ///< Records that were written.
  double sah_cost_built = 0, sah_cost = 0;  ///< As measure_tree(), with the costs that the tree was built for.
  double cost_ratio = 1;                    ///< sah_cost / sah_cost_built; 1 if the scene has no area.
  double exchange_slack_built = 0, exchange_slack = 0;  ///< As measure_tree().
  bool rebuild_advised = false;          ///< By RefitOptions. What cost_ratio says a fresh tree may cost as well.
  std::uint64_t scratch_bytes_peak = 0;  ///< Largest sum of the refit's own arrays.
  double check_seconds = 0, write_seconds = 0, measure_seconds = 0, total_seconds = 0;
};

/// Gives a BVH file, in place, the boxes and vertices of primitives that have moved. The tree, its pairs of triangles
/// and the primitive map stay; hits are those of a fresh build over the moved scene, bit for bit. Works for every
/// layout and builder; of a split triangle (kSplitReferences) every part gets the whole triangle's box.
/// The provenance stays that of the build: it does not name the moved input.
///
/// From the leaves to the root, as in Lauterbach, Yoon, Tuft, Manocha, "RT-DEFORM", 2006; a node is written by the
/// thread that comes to it last, as in Karras, "Maximizing parallelism in the construction of BVHs", 2012.
///
/// @param file aligned to 128 bytes; open_buffer() and validate() accept it (the content is not checked again).
/// @param moved as many geometries as the file has, of the same kinds and types, with the same numbers of primitives,
/// in the same order, and of shapes as many points and the same segments; masks and names do not matter. Triangles that
/// were dropped must still be ones that are dropped (input.h). A triangle in the tree whose corners now coincide stays
/// there: no ray hits it.
/// @return kInvalidInput, with the place: the file is none, or the scene another one; an index past the vertices; a
/// primitive in the tree that is not finite now, or whose box is inverted, or beyond what layout quantized holds; one
/// that is not in the tree and now would be; two triangles of one leaf whose common edge has come apart. These need a
/// build. kCancelled, kOutOfMemory. After any error @p file is what it was: once writing has begun, the callback cannot
/// cancel (and must not throw).
HIPRT_BUILD_API Result<RefitStatistics> refit(std::span<std::byte> file, const SceneInput& moved,
                                              const RefitOptions& options = {});

/// A refitted copy, and figures of the refit.
struct RefittedBvh {
  Buffer buffer;
  RefitStatistics statistics;
};

/// The same in a copy of the file, which may be read-only; the callback can cancel at any time.
HIPRT_BUILD_API Result<RefittedBvh> refit_copy(std::span<const std::byte> file, const SceneInput& moved,
                                               const RefitOptions& options = {});

}  // namespace hiprt::build
