#pragma once
/// Build times of BVHs over instances on the device.

#include <hiprt_build/gpu/hip.h>

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace hiprt::bench {

struct InstanceBench {
  std::vector<std::string> counts;  ///< Numbers of instances, as texts.
  std::vector<std::string> builders;
  unsigned repeats = 15;
  bool graphs = false;  ///< Also measures captured graphs.
};

/// Measures every count with every builder, with instance boxes from roots and from children, and validates each file.
/// Prints a table and appends to @p results. @return false after an error, which is printed.
bool run_instances(const InstanceBench& bench, hipStream_t stream, nlohmann::json& results);

}  // namespace hiprt::bench
