#pragma once
/// How long trees over instances take on the device.

#include <hip/hip_runtime.h>
#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace hiprt::bench {

struct InstanceBench {
  std::vector<std::string> counts;  ///< Of instances, as texts.
  std::vector<std::string> builders;
  unsigned repeats = 15;
  bool graphs = false;  ///< Also as graphs that are launched again and again.
};

/// Every count by every builder, with boxes of roots and of children; validates each file. Prints a table and appends
/// to
/// @p results. @return false after an error, which is printed.
bool run_instances(const InstanceBench& bench, hipStream_t stream, nlohmann::json& results);

}  // namespace hiprt::bench
