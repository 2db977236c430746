#pragma once
/// Pairs of triangles beyond the windows, on the device. Internal.

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/gpu/error.h>
#include <hiprt_build/pair/pair_beyond.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::gpu {

/// Memory of the step, for so many primitives.
struct PairBeyondScratch {
  std::uint32_t* singles;
  build::PairBeyond::Slot* table;

  static PairBeyondScratch take(Arena& arena, std::uint64_t primitives) {
    return {arena.take<std::uint32_t>(primitives),
            arena.take<build::PairBeyond::Slot>(build::PairBeyond::kSlots * primitives)};
  }
};

/// Pairs the state's single triangles, as steps of a stream; its numbers of leaves and pairs become those after it.
/// @param references [primitives]; some may be none.
Result<void> enqueue_pair_beyond(const build::GeometryTable& geometries, build::Reference* references,
                                 const PairBeyondScratch& scratch, build::kernels::BuildState* state,
                                 hipStream_t stream);

}  // namespace hiprt::gpu
