#pragma once
/// Locally-ordered clustering of sorted leaves on the device. Internal.

#include <hiprt_build/gpu/error.h>
#include <hiprt_build/input/geometry.h>
#include <hiprt_build/tree/binary_tree.h>

#include <cstddef>
#include <cstdint>

namespace hiprt::gpu {

struct PlocInput {
  const build::Reference* references;  ///< On the device, in Morton order; the first *count exist.
  const std::uint32_t* count;          ///< On the device.
  std::uint32_t capacity;              ///< *count <= capacity < 2^31.
  unsigned radius;                     ///< 1 to 128: how far a cluster looks for its nearest.
};

/// On the device.
struct PlocOutput {
  build::LinkedNode* nodes;  ///< [capacity], as of a LinkedTree; node 0 and those from *count on are not written.
  build::LinkedRef* root;    ///< kInvalidId where *count is 0.
};

/// Bytes of memory that enqueue_ploc() needs besides.
std::uint64_t ploc_scratch(std::uint32_t capacity);

/// The tree that ploc.h makes on the host, number by number. What is launched depends on the capacity and the
/// radius only.
/// @param scratch of ploc_scratch(capacity) bytes, aligned to kDeviceAlignment.
/// @return kInvalidInput for another radius or a capacity of 2^31 or more, or the runtime's error.
Result<void> enqueue_ploc(const PlocInput& input, const PlocOutput& output, std::byte* scratch, hipStream_t stream);

}  // namespace hiprt::gpu
