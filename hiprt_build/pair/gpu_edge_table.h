#pragma once
/// Pairs triangles through a hash table of their edges, on the device. Internal.

#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/gpu/error.h>
#include <hiprt_build/pair/edge_table.h>
#include <hiprt_build/pipeline/gpu_state.h>

namespace hiprt::gpu {

/// Scratch memory for so many primitives.
struct EdgeTableScratch {
  std::uint32_t* singles;
  build::EdgeTable::Slot* table;

  static EdgeTableScratch take(Arena& arena, std::uint64_t primitives) {
    return {arena.take<std::uint32_t>(primitives),
            arena.take<build::EdgeTable::Slot>(build::EdgeTable::kSlots * primitives)};
  }
};

/// Enqueues the pairing of the state's single triangles, which updates its numbers of leaves and pairs.
/// @param references [primitives]; entries without contents are skipped.
Result<void> enqueue_pair_by_edges(const build::GeometryTable& geometries, build::Reference* references,
                                   const EdgeTableScratch& scratch, build::kernels::BuildState* state,
                                   hipStream_t stream);

}  // namespace hiprt::gpu
