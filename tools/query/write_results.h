#pragma once
/// Writes the results of bvhquery.

#include <tools/query/query_command.h>

namespace hiprt::tools {

/// Writes command.output and command.paths. Names that end in .npy get arrays of numpy.
build::Result<void> write_all(const QueryCommand& command, const SceneView& scene, const QueryResults& results,
                              std::size_t queries);

}  // namespace hiprt::tools
