#pragma once
/// Which processor does the work.

namespace hiprt::tools {

enum class DeviceChoice {
  kAuto,  ///< The GPU if there is one that can do the work, else the CPU.
  kCpu,
  kGpu
};

}  // namespace hiprt::tools
