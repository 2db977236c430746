#pragma once
/// Code that a device runs.

#include <cstdint>

namespace hiprt::bench {

/// Function of a CPU that processes the items [begin, end) of a job on the calling thread.
using CpuFunction = void (*)(const void* job, std::uint64_t begin, std::uint64_t end);

/// Code for one of the two kinds of devices.
struct Kernel {
  CpuFunction cpu = nullptr;
  const void* gpu = nullptr;  ///< A __global__ function that takes the job by value.
  unsigned block = 1;         ///< Threads per block of a GPU.
};

}  // namespace hiprt::bench
