#pragma once
/// bvhbuild --refit: writes a BVH file with the old tree and refitted boxes for moved meshes or shapes.

#include <hiprt_build/error.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::tools {

class Cli;

struct RefitCommand {
  std::string file, output;
  std::vector<std::string> moved;  ///< One file per geometry: first the meshes, then the shapes.
  unsigned threads = 0;
  std::uint64_t max_memory = 0;  ///< Bytes that readers may take; 0: half of the machine's.
};

/// Prints the new SAH cost of the tree and whether a rebuild is advised.
/// @return the errors of load_bvh(), load_mesh(), load_shapes(), build::refit_copy() and build::write_file();
/// kInvalidInput if the output is an input.
build::Result<void> run_refit(const Cli& cli, const RefitCommand& command);

}  // namespace hiprt::tools
