#pragma once
/// Refits BVH files whose primitives have moved: new boxes for the old tree, several times faster than a build.
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
  /// Number of threads. 0, or more than the process may use: all of them. The result does not depend on it.
  unsigned threads = 0;
  /// At least 0: a rebuild is advised when the exchange slack (statistics.h) has grown by more than this since the
  /// build. 0.05: when a fresh tree would save half of a ray's work or more (decision 0012).
  double rebuild_slack = 0.05;
  /// At least 1: for trees with split references a rebuild is also advised when the SAH cost has grown by more than
  /// this factor. Exchange slack does not see the cost of split references.
  double rebuild_ratio = 1.5;
  ProgressCallback progress{};
};

/// The figures named "built" are those of the tree when it was built, also after several refits. They come from the
/// file's provenance. Without provenance they are those of the tree before this refit.
struct RefitStatistics {
  std::uint64_t nodes = 0, leaves = 0;      ///< Records that were written.
  double sah_cost_built = 0, sah_cost = 0;  ///< As measure_tree(), with the costs that the tree was built for.
  double cost_ratio = 1;                    ///< sah_cost / sah_cost_built; 1 if the scene has no area.
  double exchange_slack_built = 0, exchange_slack = 0;  ///< As measure_tree().
  bool rebuild_advised = false;          ///< By RefitOptions. A large cost_ratio alone may be due to the scene.
  std::uint64_t scratch_bytes_peak = 0;  ///< Peak memory of the refit's arrays.
  double check_seconds = 0, write_seconds = 0, measure_seconds = 0, total_seconds = 0;
};

/// Writes the boxes and vertices of moved primitives into a BVH file, in place. The tree, its pairs of triangles and
/// the primitive map stay. Hits are those of a fresh build over the moved scene, bit for bit. Works for every layout
/// and builder. All parts of a split triangle (kSplitReferences) get the box of the whole triangle. The provenance
/// stays that of the build.
///
/// Works from the leaves to the root (Lauterbach, Yoon, Tuft, Manocha, "RT-DEFORM", 2006). The last thread to reach a
/// node writes it (Karras, "Maximizing parallelism in the construction of BVHs", 2012).
///
/// @param file aligned to 128 bytes; open_buffer() and validate() accept it (the content is not checked again).
/// @param moved the geometries of the file, in the same order, with the same kinds, types and numbers of primitives.
/// Shapes have the same number of points and the same segments. Masks and names do not matter. Triangles that the
/// builder dropped must still be dropped ones (input.h). A triangle in the tree whose corners now coincide stays there:
/// no ray hits it.
/// @return kCancelled, kOutOfMemory, or kInvalidInput with the geometry and primitive. After kInvalidInput only a build
/// helps:
/// - @p file is no BVH file, or @p moved is another scene, or an index is past the vertices;
/// - a primitive of the tree is not finite, has an inverted box, or is too large for layout quantized;
/// - a dropped primitive would be kept by a new build;
/// - the two triangles of a leaf have lost their common edge.
/// After an error @p file is unchanged. Once writing has begun, the callback cannot cancel (and must not throw).
HIPRT_BUILD_API Result<RefitStatistics> refit(std::span<std::byte> file, const SceneInput& moved,
                                              const RefitOptions& options = {});

/// A refitted copy, and figures of the refit.
struct RefittedBvh {
  Buffer buffer;
  RefitStatistics statistics;
};

/// The same in a copy. @p file may be read-only. The callback can cancel at any time.
HIPRT_BUILD_API Result<RefittedBvh> refit_copy(std::span<const std::byte> file, const SceneInput& moved,
                                               const RefitOptions& options = {});

}  // namespace hiprt::build
