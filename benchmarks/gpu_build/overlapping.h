#pragma once
/// Times of builds where very many triangles overlap.

#include "mesh_builds.h"

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace hiprt::bench {

struct OverlapBench {
  std::vector<std::string> counts;  ///< Numbers of triangles, as texts.
  std::vector<std::string> builders;
  MeshBench meshes;
};

/// Times of meshes that overlap, beside as many triangles that do not, and beside a quarter of them: a row for each
/// mesh and builder. Prints a table and appends to @p results. @return false after an error, which is printed.
bool run_overlapping(const OverlapBench& bench, hipStream_t stream, nlohmann::json& results);

}  // namespace hiprt::bench
