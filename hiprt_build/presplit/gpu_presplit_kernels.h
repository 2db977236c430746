#pragma once
/// Kernels of gpu_cut.hip. Internal.

#include <hiprt_build/input/references.h>
#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_build/presplit/presplit_steps.h>

namespace hiprt::build::kernels {

/// Cuts in all with the scale of each try; zeroed.
struct ScaleTries {
  /// As many as ScaleSearch makes: it halves the bits of all positive floats.
  static constexpr unsigned kCount = 31 - kScalePrecision;

  unsigned long long cuts[kCount];

  /// What the first @p tries have shown.
  HIPRT_HD ScaleSearch search(unsigned tries, std::uint64_t most_cuts) const {
    ScaleSearch search;
    for (unsigned i = 0; i < tries && !search.done(); ++i) search.tried(cuts[i] <= most_cuts);
    return search;
  }
};

HIPRT_HD inline std::uint64_t most_cuts(const BuildState* state, double budget) {
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

static __global__ void __launch_bounds__(kBlock)
    weigh_references(GeometryTable geometries, const Reference* references, std::uint32_t count,
                     const BuildState* state, float* weights) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const Reference reference = references[i];
  weights[i] = 0.0f;
  if (!reference.contents.exists()) return;
  const ReferenceTriangles triangles(geometries, reference);
  weights[i] = cut_weight(CutPlanes(state->bounds.get()), reference.box, triangles.corners, triangles.pair);
}

/// The cuts in all with the scale of try @p number.
static __global__ void __launch_bounds__(kBlock)
    try_scale(const float* weights, std::uint32_t count, const BuildState* state, double budget, unsigned number,
              ScaleTries* tries) {
  const ScaleSearch search = tries->search(number, most_cuts(state, budget));
  if (search.done()) return;
  const float scale = search.next();
  __shared__ unsigned long long in_block;
  if (threadIdx.x == 0) in_block = 0;
  __syncthreads();
  unsigned long long mine = 0;
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x) mine += cut_count(weights[i], scale);
  if (mine != 0) atomicAdd(&in_block, mine);
  __syncthreads();
  if (threadIdx.x == 0 && in_block != 0) atomicAdd(&tries->cuts[number], in_block);
}

static __global__ void __launch_bounds__(kBlock)
    count_places(const Reference* references, const float* weights, std::uint32_t count, const BuildState* state,
                 double budget, const ScaleTries* tries, std::uint32_t* places) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const float scale = tries->search(ScaleTries::kCount, most_cuts(state, budget)).result();
  places[i] = references[i].contents.exists() ? cut_count(weights[i], scale) + 1 : 0;
}

/// Cuts that are to be made at a place, and since when: who cuts leaves the parts to later launches.
struct PendingCuts {
  static constexpr unsigned kCountBits = 20;
  static_assert(kMostCuts < 1u << kCountBits);

  std::uint32_t* bits;  ///< 0: none.

  HIPRT_HD std::uint32_t count(std::uint32_t place) const { return bits[place] & ((1u << kCountBits) - 1); }
  HIPRT_HD unsigned since(std::uint32_t place) const { return bits[place] >> kCountBits; }
  HIPRT_HD void set(std::uint32_t place, std::uint32_t count, unsigned since) const {
    bits[place] = since << kCountBits | count;
  }
};

struct CutPlanesOf {
  const BuildState* state;

  HIPRT_HD CutPlanes get() const { return CutPlanes(state->bounds.get()); }
};

/// CutStep's places. @p now the number of the launch.
struct LeafParts {
  GeometryTable geometries;
  Reference* parts;
  PendingCuts pending;
  unsigned now;

  HIPRT_HD Box box(std::uint32_t place) const { return parts[place].box; }
  HIPRT_HD LeafCorners corners(std::uint32_t place) const {
    return ReferenceTriangles(geometries, parts[place]).corners;
  }
  HIPRT_HD bool is_pair(std::uint32_t place) const { return parts[place].contents.is_pair(); }
  HIPRT_HD void put(std::uint32_t place, std::uint32_t from, const Box& box) const {
    parts[place] = Reference{box, parts[from].contents, parts[from].primitive};
  }
  HIPRT_HD std::uint32_t cuts(std::uint32_t place) const { return pending.count(place); }
  HIPRT_HD void set_cuts(std::uint32_t place, std::uint32_t count) const { pending.set(place, count, now); }
};

/// Parts are none, and no cuts are pending, but here.
static __global__ void __launch_bounds__(kBlock)
    place_references(const Reference* references, const float* weights, const std::uint32_t* places,
                     std::uint32_t count, const BuildState* state, double budget, const ScaleTries* tries,
                     LeafParts to) {
  const std::uint32_t i = thread_index();
  if (i >= count || !references[i].contents.exists()) return;
  const float scale = tries->search(ScaleTries::kCount, most_cuts(state, budget)).result();
  to.parts[places[i]] = references[i];
  to.set_cuts(places[i], cut_count(weights[i], scale));
}

/// One cut wherever many are pending, so that those of large references are made by many threads.
static __global__ void __launch_bounds__(kBlock)
    cut_large(CutPlanesOf planes, LeafParts parts, std::uint32_t room, std::uint32_t many) {
  const std::uint32_t place = thread_index();
  if (place >= room || parts.pending.since(place) >= parts.now || parts.cuts(place) < many) return;
  CutStep<LeafParts>{planes.get(), parts}(place);
}

/// All cuts that are left.
static __global__ void __launch_bounds__(kBlock) cut_rest(CutPlanesOf planes, LeafParts parts, std::uint32_t room) {
  const std::uint32_t first = thread_index();
  if (first >= room || parts.pending.since(first) >= parts.now) return;
  const std::uint32_t cuts = parts.cuts(first);
  if (cuts == 0) return;
  const CutStep<LeafParts> step{planes.get(), parts};
  for (std::uint32_t place = first; place <= first + cuts; ++place)
    while (step(place)) {
    }
}

/// The parts there are.
static __global__ void __launch_bounds__(kBlock)
    count_parts(const Reference* parts, std::uint32_t room, std::uint32_t* count) {
  const std::uint32_t i = thread_index();
  const WaveGroup group;
  const std::uint32_t here = lane_count(group.ballot(i < room && parts[i].contents.exists()));
  if (group.lane() == 0 && here != 0) fetch_add(count, here);
}
static __global__ void set_leaves(const std::uint32_t* count, BuildState* state) { state->counts.leaves = *count; }

}  // namespace hiprt::build::kernels
