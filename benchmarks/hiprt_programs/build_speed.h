#pragma once
/// Speed of libhiprt's build functions beside this library's own.

#include "library.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace hiprt::bench {

/// Times builds of a mesh by each builder, an update, and a scene of instances of the mesh. Both sides have their
/// memory before: no time of allocations counts.
/// @param results JSON is appended: one object per function.
/// @return a table.
build::Result<std::string> time_builds(Library& library, const std::string& name, DeviceMesh& mesh,
                                       std::uint32_t instances, unsigned repeats, hipStream_t stream,
                                       nlohmann::json& results);

/// Times a batch of small meshes.
build::Result<std::string> time_batch(Library& library, std::uint32_t count, unsigned repeats, hipStream_t stream,
                                      nlohmann::json& results);

}  // namespace hiprt::bench
