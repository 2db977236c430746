#pragma once
/// Bytes of unknown origin in, a verdict out. Host only; any thread.
///
/// After a success a traversal with a stack of FileHeader::stack_bound entries cannot read out of bounds, loop or
/// overflow its stack, and misses no primitive because of a wrong box. What is checked, rule by rule:
/// hiprt_device/docs/FORMAT.md.

#include <hiprt_build/export.h>
#include <hiprt_build/format/error.h>
#include <hiprt_build/format/view.h>

#include <tl/expected.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace hiprt {

/// Calls body(i) for every i below a count, in any order, on one thread or many.
using ParallelLoop = std::function<void(std::size_t count, const std::function<void(std::size_t i)>& body)>;

/// What validate() counted on its way.
struct ValidateSummary {
  std::uint64_t nodes = 0;
  std::uint64_t leaves = 0;
  std::uint64_t leaf_runs = 0;       ///< References to leaves.
  std::uint64_t leaf_triangles = 0;  ///< Triangles in leaves; a split primitive counts once per leaf.
  std::uint64_t leaf_customs = 0;    ///< Custom primitives in leaves.
  std::uint64_t primitives = 0;      ///< Over all geometries, dropped ones included.
  std::uint64_t dropped = 0;         ///< Primitives in no leaf.
  std::uint64_t split = 0;           ///< Primitives in more than one leaf.
  std::uint32_t depth = 0;           ///< Box nodes on the longest path.
  std::uint64_t instances = 0;       ///< In leaves, of the scene's own tree.
  std::uint64_t objects = 0;         ///< Of instances.
  std::uint64_t shape_points = 0;    ///< Of spheres and curves, of the file's own geometries.
  std::uint32_t stack_need = 0;  ///< Most stack entries a depth-first traversal can have; at most the header's bound.
};

/// Checks a whole file: open_buffer(), the checksum, then all content, in a few passes over the bytes.
/// @param bytes the whole file, aligned to 128 bytes (mapped, or read into an aligned buffer). Never reads outside.
/// @param loop may check the boxes of instances on many threads; the result is the same.
/// @return what was counted, or the first thing that is wrong. Uses 4 bytes of memory per node, a few bits per leaf and
///         primitive, and 24 bytes per split primitive. Throws std::bad_alloc only.
HIPRT_BUILD_API tl::expected<ValidateSummary, FormatIssue> validate(std::span<const std::byte> bytes,
                                                                    const ParallelLoop& loop);
/// The same on this thread.
HIPRT_BUILD_API tl::expected<ValidateSummary, FormatIssue> validate(std::span<const std::byte> bytes);

}  // namespace hiprt
