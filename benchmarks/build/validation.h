#pragma once
/// Time to validate a file.

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

/// Builds a temporary file with the library's defaults and validates it @p rounds times, from the system's file cache.
build::Result<ValidationCell> measure_validation(const build::TriangleMesh& mesh, const std::string& scene,
                                                 unsigned rounds);

}  // namespace hiprt::bench
