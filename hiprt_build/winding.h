#pragma once
/// The arrays that winding numbers are asked of (hiprt_device/query/winding_number.h).
///
///     const auto arrays = hiprt::build::winding_arrays(*hiprt::open_buffer(bvh->buffer.bytes()));
///     const hiprt::Side side = hiprt::is_inside(arrays->tree(), {1, 2, 3});

#include <hiprt_build/error.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/winding_tree.h>

#include <cstdint>
#include <vector>

namespace hiprt::build {

/// About 36 bytes per triangle, and 128 per node. A GPU takes a copy of both arrays.
struct WindingArrays {
  std::vector<WindingNode> nodes;          ///< A node, then the nodes below it.
  std::vector<WindingTriangle> triangles;  ///< Each once, in the order of the tree's leaves.

  /// @pre the arrays live as long as the tree is used.
  WindingTree tree() const { return {nodes.data(), triangles.data(), static_cast<std::uint32_t>(nodes.size())}; }
};

/// Collects the triangles of a file along its tree, and what each part of them is from afar.
/// @param view of a validated file.
/// @param mask geometries with (mask & theirs) != 0 count.
/// @param threads 0, or more than the process may use: all of them.
/// @return the same arrays for any number of threads. kInvalidInput for a file with instances or custom primitives:
/// winding numbers are those of one mesh. kOutOfMemory.
HIPRT_BUILD_API Result<WindingArrays> winding_arrays(const BufferView& view, std::uint32_t mask = 0xffffffffu,
                                                     unsigned threads = 0);

}  // namespace hiprt::build
