#pragma once
/// What results say of the machine.

#include <string>

namespace hiprt::bench {

/// As Linux calls the processor; "unknown" elsewhere.
std::string cpu_name();

}  // namespace hiprt::bench
