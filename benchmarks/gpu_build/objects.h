#pragma once
/// Times of scenes whose objects and instances the device builds.

#include <hiprt_build/gpu/hip.h>

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace hiprt::bench {

struct ObjectBench {
  std::vector<std::string> counts;  ///< Numbers of objects, as texts. Each has one instance.
  unsigned repeats = 15;
};

/// Measures a batch build of the objects (4 to 220 triangles each), the records of the objects, a build
/// over their instances, and an update of that. Validates the downloaded scene, up to 100,000 objects. Prints a table
/// and appends to
/// @p results. @return false after an error, which is printed.
bool run_objects(const ObjectBench& bench, hipStream_t stream, nlohmann::json& results);

}  // namespace hiprt::bench
