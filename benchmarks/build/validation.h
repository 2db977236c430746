#pragma once
/// How long it takes to check a file.

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>

#include <cstdint>
#include <string>

namespace hiprt::bench {

struct ValidationCell {
  std::string scene;
  std::uint64_t triangles = 0, bytes = 0;
  double seconds = 0;  ///< Median over the rounds of mapping the file, validate() and unmapping; one thread.
};

/// Builds a file with the library's defaults in the folder for temporary files and validates it @p rounds times, from
/// the system's file cache.
build::Result<ValidationCell> measure_validation(const build::TriangleMesh& mesh, const std::string& scene,
                                                 unsigned rounds);

}  // namespace hiprt::bench
