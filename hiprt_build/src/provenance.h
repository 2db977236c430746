#pragma once
/// The JSON provenance block of a file. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/exec/monitor.h>

#include <string>

namespace hiprt::build {

/// What made the file and from what. Holds no times and no thread count: the same input gives the same bytes.
/// @param rounds of reinsertion that there were. @param monitor asked while the input is hashed.
std::string make_provenance(Monitor& monitor, const SceneInput& scene, const BuildOptions& options, unsigned rounds,
                            const BuildStatistics& statistics, double sah_cost);

}  // namespace hiprt::build
