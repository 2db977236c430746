#pragma once
/// Kernels of the tests. C++ sources launch them with hiprt::gpu::launch().

#include <hiprt_build/gpu/hip.h>
#include <hiprt_device/scene_view.h>

namespace hiprt::checks {

/// Threads of a block of small_blocks(), at most.
inline constexpr unsigned kSmallBlock = 64;

/// out[i] = first + i for i < count; further threads add 1 to *beyond.
__global__ void write_indices(unsigned* out, unsigned first, unsigned count, unsigned* beyond);

/// out[thread] = block y * grid x + block x, for threads of a grid in two dimensions.
__global__ void write_blocks(unsigned* out);

/// out[i] = in[block's last thread - i], through dynamic shared memory of 4 bytes per thread.
__global__ void reverse_blocks(const unsigned* in, unsigned* out);

/// Launch bounds of kSmallBlock threads.
__global__ void small_blocks(unsigned* out);

/// *size = scene.size.
__global__ void write_scene_size(SceneView scene, std::uint64_t* size);

/// Without launch bounds: limited by compiler and device.
__global__ void nothing();

}  // namespace hiprt::checks
