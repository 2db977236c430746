#pragma once
/// The JSON provenance block of a file. Internal.

#include <hiprt_build/build.h>

#include <string>

namespace hiprt::build {

/// What made the file and from what. Holds no times and no thread count: the same input gives the same bytes.
std::string make_provenance(const SceneInput& scene, const BuildOptions& options, const BuildStatistics& statistics,
                            double sah_cost);

}  // namespace hiprt::build
