#pragma once
/// Trees of other programs (hiprt_build/exchange.h) as JSON:
///
///     {"format": "hiprt exchange bvh", "version": 1,
///      "nodes": [{"min": [0, 0, 0], "max": [2, 1, 0], "children": [1, 2]},
///                {"min": [0, 0, 0], "max": [1, 1, 0], "primitives": [0, 1]},
///                {"min": [1, 0, 0], "max": [2, 1, 0], "primitives": [1, 3]}],
///      "primitives": [2, 0, 3, 1]}
///
/// "children" and a node's "primitives" are the first and how many: nodes 1 and 2, entries 1, 2 and 3. A node has one
/// of the two. Keys may stand in any order; others than these are refused.

#include <hiprt_build/error.h>
#include <hiprt_build/exchange.h>

#include <filesystem>

namespace hiprt::tools {

/// Reads the form only: whether it is a tree over some scene says build::validate().
/// @return kIo, or kInvalidInput with path, location ("nodes[7].min[2]", or line and column) and the reason.
build::Result<build::ExchangeBvh> read_exchange(const std::filesystem::path& path);

/// Writes as write_file() does. Every float has nine significant digits: readers convert it back to the same float,
/// also through double.
/// @return the errors of write_file(), or kInvalidInput for a box that is not finite, which JSON cannot hold.
build::Result<void> write_exchange(const std::filesystem::path& path, const build::ExchangeBvh& tree);

}  // namespace hiprt::tools
