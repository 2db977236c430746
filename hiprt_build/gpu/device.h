#pragma once
/// What GPUs there are. Nothing here changes the current device.

#include <hiprt_build/gpu/error.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::gpu {

struct Device {
  int index = 0;             ///< As hipSetDevice() takes it.
  std::string name;          ///< Of the product.
  std::string architecture;  ///< "gfx90a", "gfx1030", "sm_90": without what may follow after a colon.
  unsigned wave_size = 0;    ///< Threads that run in step: a wave, a warp.
  unsigned compute_units = 0;
  unsigned max_threads_per_block = 0;
  std::uint64_t memory_bytes = 0;
  std::uint64_t shared_bytes_per_block = 0;  ///< Shared memory that a block can have without asking for more.
};

namespace device_detail {

/// AMD's runtime names the architecture, NVIDIA's gives two numbers.
template <class Properties> std::string architecture(const Properties& properties) {
  if constexpr (requires { properties.gcnArchName; }) {
    const std::string full = properties.gcnArchName;
    return full.substr(0, full.find(':'));
  } else {
    return "sm_" + std::to_string(properties.major) + std::to_string(properties.minor);
  }
}

/// @return at least 1, or kNoDevice.
inline Result<int> count() {
  int devices = 0;
  if (auto counted = check(hipGetDeviceCount(&devices), "hipGetDeviceCount"); !counted)
    return tl::unexpected(std::move(counted.error()));
  if (devices < 1) return fail(ErrorCode::kNoDevice, "hipGetDeviceCount: 0, no GPU can be used here");
  return devices;
}

inline Result<Device> read(int index) {
  hipDeviceProp_t properties{};
  if (auto got = check(hipGetDeviceProperties(&properties, index), "hipGetDeviceProperties", "device ", index); !got)
    return tl::unexpected(got.error());
  Device device;
  device.index = index;
  device.name = properties.name;
  device.architecture = architecture(properties);
  device.wave_size = static_cast<unsigned>(properties.warpSize);
  device.compute_units = static_cast<unsigned>(properties.multiProcessorCount);
  device.max_threads_per_block = static_cast<unsigned>(properties.maxThreadsPerBlock);
  device.memory_bytes = properties.totalGlobalMem;
  device.shared_bytes_per_block = properties.sharedMemPerBlock;
  return device;
}

}  // namespace device_detail

/// @return all GPUs of this process, at least one, or kNoDevice.
inline Result<std::vector<Device>> devices() {
  const auto count = device_detail::count();
  if (!count) return tl::unexpected(count.error());
  std::vector<Device> result;
  for (int i = 0; i < *count; ++i) {
    auto device = device_detail::read(i);
    if (!device) return tl::unexpected(device.error());
    result.push_back(std::move(*device));
  }
  return result;
}

/// @return kNoDevice without a GPU, kInvalidInput if there are fewer.
inline Result<Device> device(int index) {
  const auto count = device_detail::count();
  if (!count) return tl::unexpected(count.error());
  if (index < 0 || index >= *count)
    return fail(ErrorCode::kInvalidInput, "device ", index, " of ", *count, ": there is no such GPU");
  return device_detail::read(index);
}

/// The one that the calling thread's launches and allocations go to.
inline Result<Device> current_device() {
  if (auto count = device_detail::count(); !count) return tl::unexpected(count.error());
  int index = 0;
  if (auto got = check(hipGetDevice(&index), "hipGetDevice"); !got) return tl::unexpected(got.error());
  return device_detail::read(index);
}

}  // namespace hiprt::gpu
