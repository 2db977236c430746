#pragma once
/// Validates bytes of unknown origin. Host only; any thread.
///
/// After a success, a traversal with a stack of FileHeader::stack_bound entries never reads out of bounds, loops, or
/// overflows its stack. It misses no primitive because of a wrong box, except parts of split triangles: see
/// hiprt_device/docs/FORMAT.md.

#include <hiprt_build/export.h>
#include <hiprt_build/format/error.h>
#include <hiprt_build/format/parallel_loop.h>
#include <hiprt_build/format/view.h>

#include <tl/expected.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt {

/// The numbers that validate() has counted.
struct ValidateSummary {
  std::uint64_t nodes = 0;
  std::uint64_t leaves = 0;
  std::uint64_t leaf_runs = 0;       ///< Number of references to leaves.
  std::uint64_t leaf_triangles = 0;  ///< Number of triangles in leaves; a split primitive counts once per leaf.
  std::uint64_t leaf_customs = 0;    ///< Number of custom primitives in leaves.
  std::uint64_t primitives = 0;      ///< Number of primitives of all geometries, including dropped ones.
  std::uint64_t dropped = 0;         ///< Number of primitives in no leaf.
  std::uint64_t split = 0;           ///< Number of primitives in more than one leaf.
  std::uint32_t depth = 0;           ///< Number of box nodes on the longest path.
  std::uint64_t instances = 0;       ///< Number of instances in leaves of the scene's own tree.
  std::uint64_t objects = 0;         ///< Number of objects.
  std::uint64_t shape_points = 0;    ///< Number of points of spheres and curves of the file's own geometries.
  std::uint32_t stack_need = 0;      ///< The most stack entries of a depth-first traversal; at most the header's bound.
};

/// Checks a whole file: open_buffer(), the checksum, then all content, in a few passes over the bytes.
/// @param bytes the whole file, aligned to 128 bytes (mapped, or read into an aligned buffer). Never reads outside.
/// @param loop may check the boxes of instances on many threads; the result is the same.
/// @return the counts, or the first fault.
///
/// Uses 4 bytes of memory per node, a few bits per leaf and primitive, and 24 bytes per split primitive. Throws
/// std::bad_alloc only.
HIPRT_BUILD_API tl::expected<ValidateSummary, FormatIssue> validate(std::span<const std::byte> bytes,
                                                                    const ParallelLoop& loop);
/// The same on this thread.
HIPRT_BUILD_API tl::expected<ValidateSummary, FormatIssue> validate(std::span<const std::byte> bytes);

}  // namespace hiprt
