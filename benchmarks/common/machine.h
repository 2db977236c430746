#pragma once
/// The machine, for results.

#include <string>

namespace hiprt::bench {

/// Name of the processor from /proc/cpuinfo; "unknown" on other systems.
std::string cpu_name();

}  // namespace hiprt::bench
