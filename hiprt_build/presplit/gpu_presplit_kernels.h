#pragma once
/// Kernels of gpu_presplit.hip. Internal.

#include <hiprt_build/input/references.h>
#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_build/presplit/presplit_steps.h>

namespace hiprt::build::kernels {

/// Splits in all with the scale of each try; zeroed.
struct ScaleTries {
  /// As many as ScaleSearch makes: it halves the bits of all positive floats.
  static constexpr unsigned kCount = 31 - kScalePrecision;

  unsigned long long splits[kCount];

  /// What the first @p tries have shown.
  HIPRT_HD ScaleSearch search(unsigned tries, std::uint64_t max_splits) const {
    ScaleSearch search;
    for (unsigned i = 0; i < tries && !search.done(); ++i) search.tried(splits[i] <= max_splits);
    return search;
  }
};

HIPRT_HD inline std::uint64_t max_splits(const BuildState* state, double budget) {
  const std::uint32_t leaves = state->counts.leaves;
  return split_capacity(leaves, budget) - leaves;
}

/// The triangles of a reference.
struct ReferenceTriangles {
  LeafCorners corners;
  bool pair;

  HIPRT_HD ReferenceTriangles(const GeometryTable& geometries, const Reference& reference) {
    const GeometryView& mesh = geometries[geometries.find(reference.primitive)];
    corners = leaf_corners(mesh, reference.primitive - mesh.first, reference.contents);
    pair = reference.contents.is_pair();
  }
};

/// Adds to the state's demand. Its bounds are known. The grid may be smaller than the number of references.
static __global__ void __launch_bounds__(kBlock)
    measure_demand(GeometryTable geometries, const Reference* references, std::uint32_t count, BuildState* state) {
  __shared__ SplitDemand in_block;
  if (threadIdx.x == 0) in_block = SplitDemand{};
  __syncthreads();
  const float scene = half_area(state->bounds.get());
  SplitDemand mine{};
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x) {
    const Reference reference = references[i];
    if (!reference.contents.exists()) continue;
    const ReferenceTriangles triangles(geometries, reference);
    mine.add(SplitDemand::of(scene, reference.box, triangles.corners, triangles.pair));
  }
  atomicAdd(&in_block.boxes, mine.boxes);
  atomicAdd(&in_block.least, mine.least);
  __syncthreads();
  if (threadIdx.x != 0) return;
  atomicAdd(&state->demand.boxes, in_block.boxes);
  atomicAdd(&state->demand.least, in_block.least);
}

static __global__ void __launch_bounds__(kBlock)
    weigh_references(GeometryTable geometries, const Reference* references, std::uint32_t count,
                     const BuildState* state, float* weights) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const Reference reference = references[i];
  weights[i] = 0.0f;
  if (!reference.contents.exists()) return;
  const ReferenceTriangles triangles(geometries, reference);
  weights[i] = split_weight(SplitPlanes(state->bounds.get()), reference.box, triangles.corners, triangles.pair);
}

/// Sums up the splits for the scale of try @p number.
static __global__ void __launch_bounds__(kBlock)
    try_scale(const float* weights, std::uint32_t count, const BuildState* state, double budget, unsigned number,
              ScaleTries* tries) {
  const ScaleSearch search = tries->search(number, max_splits(state, budget));
  if (search.done()) return;
  const float scale = search.next();
  __shared__ unsigned long long in_block;
  if (threadIdx.x == 0) in_block = 0;
  __syncthreads();
  unsigned long long mine = 0;
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x) mine += split_count(weights[i], scale);
  if (mine != 0) atomicAdd(&in_block, mine);
  __syncthreads();
  if (threadIdx.x == 0 && in_block != 0) atomicAdd(&tries->splits[number], in_block);
}

static __global__ void __launch_bounds__(kBlock)
    count_slots(const Reference* references, const float* weights, std::uint32_t count, const BuildState* state,
                double budget, const ScaleTries* tries, std::uint32_t* slots) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const float scale = tries->search(ScaleTries::kCount, max_splits(state, budget)).result();
  slots[i] = references[i].contents.exists() ? split_count(weights[i], scale) + 1 : 0;
}

/// The number of splits still to be made at each slot, and the launch that set it. A launch leaves the parts that it
/// makes to later launches.
struct PendingSplits {
  static constexpr unsigned kCountBits = 20;
  static_assert(kMaxSplits < 1u << kCountBits);

  std::uint32_t* bits;  ///< 0: none.

  HIPRT_HD std::uint32_t count(std::uint32_t slot) const { return bits[slot] & ((1u << kCountBits) - 1); }
  HIPRT_HD unsigned since(std::uint32_t slot) const { return bits[slot] >> kCountBits; }
  HIPRT_HD void set(std::uint32_t slot, std::uint32_t count, unsigned since) const {
    bits[slot] = since << kCountBits | count;
  }
};

struct ScenePlanes {
  const BuildState* state;

  HIPRT_HD SplitPlanes get() const { return SplitPlanes(state->bounds.get()); }
};

/// The slots of PresplitStep. @p now the number of the launch.
struct ReferenceParts {
  GeometryTable geometries;
  Reference* parts;
  PendingSplits pending;
  unsigned now;

  HIPRT_HD Box box(std::uint32_t slot) const { return parts[slot].box; }
  HIPRT_HD LeafCorners corners(std::uint32_t slot) const { return ReferenceTriangles(geometries, parts[slot]).corners; }
  HIPRT_HD bool is_pair(std::uint32_t slot) const { return parts[slot].contents.is_pair(); }
  HIPRT_HD void put(std::uint32_t slot, std::uint32_t from, const Box& box) const {
    parts[slot] = Reference{box, parts[from].contents, parts[from].primitive};
  }
  HIPRT_HD std::uint32_t splits(std::uint32_t slot) const { return pending.count(slot); }
  HIPRT_HD void set_splits(std::uint32_t slot, std::uint32_t count) const { pending.set(slot, count, now); }
};

/// Writes each reference to its first slot. All other slots stay empty.
static __global__ void __launch_bounds__(kBlock)
    scatter_input(const Reference* references, const float* weights, const std::uint32_t* slots, std::uint32_t count,
                  const BuildState* state, double budget, const ScaleTries* tries, ReferenceParts to) {
  const std::uint32_t i = thread_index();
  if (i >= count || !references[i].contents.exists()) return;
  const float scale = tries->search(ScaleTries::kCount, max_splits(state, budget)).result();
  to.parts[slots[i]] = references[i];
  to.set_splits(slots[i], split_count(weights[i], scale));
}

/// Makes one split at every slot with many pending splits, so that many threads share the work of large references.
static __global__ void __launch_bounds__(kBlock)
    split_large(ScenePlanes planes, ReferenceParts parts, std::uint32_t capacity, std::uint32_t many) {
  const std::uint32_t slot = thread_index();
  if (slot >= capacity || parts.pending.since(slot) >= parts.now || parts.splits(slot) < many) return;
  PresplitStep<ReferenceParts>{planes.get(), parts}(slot);
}

/// Makes all splits that are left.
static __global__ void __launch_bounds__(kBlock)
    split_remaining(ScenePlanes planes, ReferenceParts parts, std::uint32_t capacity) {
  const std::uint32_t first = thread_index();
  if (first >= capacity || parts.pending.since(first) >= parts.now) return;
  const std::uint32_t splits = parts.splits(first);
  if (splits == 0) return;
  const PresplitStep<ReferenceParts> step{planes.get(), parts};
  for (std::uint32_t slot = first; slot <= first + splits; ++slot)
    while (step(slot)) {
    }
}

/// Counts the parts.
static __global__ void __launch_bounds__(kBlock)
    count_parts(const Reference* parts, std::uint32_t capacity, std::uint32_t* count) {
  const std::uint32_t i = thread_index();
  const WaveGroup group;
  const std::uint32_t here = lane_count(group.ballot(i < capacity && parts[i].contents.exists()));
  if (group.lane() == 0 && here != 0) fetch_add(count, here);
}
static __global__ void set_leaves(const std::uint32_t* count, BuildState* state) { state->counts.leaves = *count; }

}  // namespace hiprt::build::kernels
