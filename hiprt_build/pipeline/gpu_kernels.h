#pragma once
/// Kernels of the GPU builders: one launch per step. Counts that only the device knows are in BuildState. Internal.

#include <hiprt_build/gpu/build.h>
#include <hiprt_build/pipeline/gpu_state.h>
#include <hiprt_build/refit/refit_file.h>
#include <hiprt_device/format/quantize.h>

namespace hiprt::build::kernels {

using gpu::BuildReport;
using gpu::BuildStatus;

/// Arguments of put_geometries().
struct GeometryChunk {
  static constexpr unsigned kSize = 32;
  GeometryView views[kSize];
};

static __global__ void start(BuildState* state) {
  state->bounds.clear();
  state->centers.clear();
  state->counts = GroupCounts{};
  state->whole = kInvalidId;
  state->root = kInvalidId;
  state->too_deep = 0;
  state->wide = WideProgress{};
}

static __global__ void put_geometries(GeometryChunk chunk, std::uint32_t begin, std::uint32_t count,
                                      GeometryView* views, GeometryRecord* records) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const GeometryView view = chunk.views[i];
  views[begin + i] = view;
  records[begin + i] = GeometryRecord{view.first, view.primitive_count, 0, view.mask, view.flags};
}

/// Leaves, their boxes and the scene's; each group of lanes takes a window after the other.
/// @param singles the triangles that stay single, in any order; nullptr: nobody asks.
static __global__ void __launch_bounds__(kGroupBlock)
    pair_primitives(PairWindow<WaveGroup> windows, Reference* references, std::uint32_t* singles,
                    GeometryRecord* records, BuildState* state) {
  __shared__ PairWindow<WaveGroup>::Shared shared[kGroupsPerBlock];
  __shared__ SharedBox bounds, centers;
  __shared__ GroupCounts counts;
  if (threadIdx.x == 0) {
    bounds.clear();
    centers.clear();
    counts = GroupCounts{};
  }
  __syncthreads();
  Box my_bounds = empty_box(), my_centers = empty_box();
  GroupCounts mine{};
  const unsigned my_group = threadIdx.x / WaveGroup::kLanes;
  const std::uint32_t all = (windows.geometries.primitive_count + kPairWindow - 1) / kPairWindow;
  for (std::uint32_t w = blockIdx.x * kGroupsPerBlock + my_group; w < all; w += gridDim.x * kGroupsPerBlock)
    windows(WaveGroup{}, shared[my_group], w, [&](const PairedPrimitive& paired) {
      const Reference reference{paired.box, paired.contents, paired.primitive};
      references[paired.primitive] = reference;
      if (singles != nullptr && EdgeTable::is_single(reference))
        singles[fetch_add(&state->counts.singles, 1)] = paired.primitive;
      if (paired.dropped != kKept) {
        fetch_add(&counts.dropped[paired.dropped], 1);
        atomicAdd(reinterpret_cast<unsigned long long*>(&records[paired.geometry].dropped_count), 1ull);
      }
      if (!paired.contents.exists()) return;
      grow(my_bounds, paired.box);
      grow(my_centers, split_point(paired.box));
      ++mine.leaves;
      mine.pairs += paired.contents.is_pair() ? 1 : 0;
      mine.customs += paired.contents.is_custom() ? 1 : 0;
    });
  if (my_bounds.min[0] <= my_bounds.max[0]) {
    bounds.add(my_bounds);
    centers.add(my_centers);
    fetch_add(&counts.leaves, mine.leaves);
    fetch_add(&counts.pairs, mine.pairs);
    fetch_add(&counts.customs, mine.customs);
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  if (counts.leaves != 0) {
    state->bounds.add(bounds.get());
    state->centers.add(centers.get());
    fetch_add(&state->counts.leaves, counts.leaves);
    fetch_add(&state->counts.pairs, counts.pairs);
    fetch_add(&state->counts.customs, counts.customs);
  }
  for (unsigned reason = 1; reason < 4; ++reason)
    if (counts.dropped[reason] != 0) fetch_add(&state->counts.dropped[reason], counts.dropped[reason]);
}

/// Keys of primitives that are not the first of a leaf come last.
static __global__ void __launch_bounds__(kBlock)
    make_keys(const Reference* references, std::uint32_t count, unsigned bits, const BuildState* state,
              std::uint64_t* keys, std::uint32_t* values) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const Reference reference = references[i];
  const MortonGrid grid = MortonGrid::over(state->centers.get(), bits);
  keys[i] = reference.contents.exists() ? grid.code(reference.box) : ~std::uint64_t{0};
  values[i] = i;
}

static __global__ void note_whole(BuildState* state) { state->whole = state->counts.leaves; }

static __global__ void clear_centers(BuildState* state) { state->centers.clear(); }
/// Of all references.
static __global__ void __launch_bounds__(kBlock)
    bound_centers(const Reference* references, std::uint32_t count, BuildState* state) {
  __shared__ SharedBox centers;
  if (threadIdx.x == 0) centers.clear();
  __syncthreads();
  Box mine = empty_box();
  for (std::uint32_t i = thread_index(); i < count; i += gridDim.x * blockDim.x)
    if (references[i].contents.exists()) grow(mine, split_point(references[i].box));
  if (mine.min[0] <= mine.max[0]) centers.add(mine);
  __syncthreads();
  if (threadIdx.x == 0 && !centers.empty()) state->centers.add(centers.get());
}

static __global__ void __launch_bounds__(kBlock)
    gather_leaves(const Reference* references, const std::uint64_t* keys, const std::uint32_t* order,
                  const BuildState* state, SortedLeaves sorted) {
  const std::uint32_t i = thread_index(), count = state->counts.leaves;
  if (i >= count) return;
  const Reference reference = references[order[i]];
  sorted.references[i] = reference;
  sorted.primitives[i] = LeafPrimitives{reference.primitive, reference.contents};
  sorted.met[i] = kInvalidId;
  if (i + 1 < count) sorted.levels[i] = boundary_level(keys[i], keys[i + 1], i);
}

static __global__ void __launch_bounds__(kBlock)
    climb_lbvh(PlannedTree tree, SortedLeaves sorted, const BuildState* state) {
  const std::uint32_t i = thread_index();
  if (i < state->counts.leaves) LbvhStep<PlannedTree>{tree, state->counts.leaves, sorted.levels, sorted.met}(i);
}

static __global__ void __launch_bounds__(kGroupBlock)
    climb_hploc(PlannedTree tree, SortedLeaves sorted, KeptCluster* kept, std::uint32_t radius,
                const BuildState* state) {
  using Climber = Hploc<WaveGroup, PlannedTree>;
  __shared__ Climber::Shared shared[kGroupsPerBlock];
  const Climber climber{tree, state->counts.leaves, sorted.levels, sorted.met, kept, radius};
  climber(WaveGroup{}, shared[threadIdx.x / WaveGroup::kLanes], thread_index());
}

static __global__ void __launch_bounds__(kBlock)
    list_primitives(const Reference* references, std::uint32_t count, LeafPrimitives* primitives) {
  const std::uint32_t i = thread_index();
  if (i < count) primitives[i] = LeafPrimitives{references[i].primitive, references[i].contents};
}

/// Whether the tree must be made again: the climbs have to begin anew.
static __global__ void __launch_bounds__(kBlock)
    check_depth(const CollapsePlan* plans, SortedLeaves sorted, BuildState* state) {
  const std::uint32_t i = thread_index();
  if (i >= state->counts.leaves) return;
  const LinkedRef root = state->root;
  if ((root & kLinkedLeaf) != 0 || plans[root].need <= kMaxStackBound) return;
  sorted.met[i] = kInvalidId;
  if (i == 0) state->too_deep = 1;
}
static __global__ void __launch_bounds__(kBlock)
    lbvh_again(PlannedTree tree, SortedLeaves sorted, const BuildState* state) {
  const std::uint32_t i = thread_index();
  if (state->too_deep != 0 && i < state->counts.leaves)
    LbvhStep<PlannedTree>{tree, state->counts.leaves, sorted.levels, sorted.met}(i);
}

template <class Layout>
__global__ void __launch_bounds__(kBlock)
    begin_wide_tree(WideWriter<Layout> writer, WideQueue queue, BuildState* state) {
  if (state->counts.leaves != 0) begin_wide(writer, queue, state->root, thread_index(), state->wide);
}
template <class Layout>
__global__ void __launch_bounds__(kBlock)
    write_wide_tree(WideWriter<Layout> writer, WideQueue queue, BuildState* state) {
  if (state->counts.leaves != 0) write_wide(writer, queue, state->root, state->wide);
}

/// Where everything is in the output.
struct OutputPlan {
  std::byte* base;
  SectionEntry sections[kTreeSections];
  std::uint64_t size;  ///< Bytes of the file; the report lies behind.
  BuildReport* report;
  NodeLayout layout;
  Builder builder;
  std::uint32_t geometries, primitives;
};

/// Whether layout quantized can hold it; the empty box can.
HIPRT_HD inline bool is_quantizable(const Box& box) {
  for (unsigned axis = 0; axis < 3; ++axis)
    if (box.min[axis] <= -kQuantizedLimit || box.max[axis] >= kQuantizedLimit) return false;
  return true;
}

static __global__ void finish(OutputPlan plan, const CollapsePlan* plans, const BuildState* state) {
  const GroupCounts& counts = state->counts;
  const LinkedRef root = state->root;
  const bool is_leaf = (root & kLinkedLeaf) != 0, is_run = counts.leaves != 0 && (is_leaf || plans[root].is_run());
  const bool too_deep = state->wide.stack_need > kMaxStackBound;
  const bool too_large = plan.layout == NodeLayout::kQuantized && !is_quantizable(state->bounds.get());
  const std::uint32_t nodes = counts.leaves == 0 || is_run ? 0 : plans[root].nodes;
  FeatureMask features = 0;
  if (counts.leaves > counts.customs) features |= feature_bit(Feature::kTriangles);
  if (counts.customs != 0) features |= feature_bit(Feature::kCustom);
  if (counts.leaves > state->whole) features |= feature_bit(Feature::kSplitReferences);
  const auto* records = reinterpret_cast<const GeometryRecord*>(plan.base + plan.sections[kGeometriesAt].offset);
  for (std::uint32_t i = 0; i < plan.geometries; ++i)
    if (records[i].mask != 0xffffffffu) features |= feature_bit(Feature::kMasks);
  NodeRef ref = kInvalidRef;
  if (is_run && !too_large)
    ref = make_ref(plan.sections[kLeavesAt].offset,
                   counts.customs == counts.leaves ? NodeType::kProcedural : NodeType::kTriangle0);
  else if (nodes != 0 && !too_deep && !too_large)
    ref = make_ref(plan.sections[kNodesAt].offset,
                   plan.layout == NodeLayout::kHalf ? NodeType::kBox16 : NodeType::kBox32);

  FileHeader header{};
  for (unsigned i = 0; i < sizeof(kMagic); ++i) header.magic[i] = "HIPRTBVH"[i];
  header.version_major = kVersionMajor;
  header.version_minor = kVersionMinor;
  header.layout = static_cast<std::uint32_t>(plan.layout);
  header.features = features;
  header.byte_size = plan.size;
  header.section_count = kTreeSections;
  header.root = ref;
  header.stack_bound = state->wide.stack_need;
  header.geometry_count = plan.geometries;
  header.bounds = state->bounds.get();
  header.primitive_count = plan.primitives;
  *reinterpret_cast<FileHeader*>(plan.base) = header;
  plan.sections[kNodesAt].count = nodes;
  plan.sections[kLeavesAt].count = counts.leaves;
  for (unsigned i = 0; i < kTreeSections; ++i)
    reinterpret_cast<SectionEntry*>(plan.base + sizeof(FileHeader))[i] = plan.sections[i];

  BuildReport report;
  report.view.base = plan.base;
  report.view.size = plan.size;
  report.view.geometries = records;
  report.view.root = ref;
  report.view.stack_bound = state->wide.stack_need;
  report.view.features = features;
  report.view.layout = plan.layout;
  report.view.bounds = header.bounds;
  report.nodes = nodes;
  report.leaves = counts.leaves;
  report.custom_leaves = counts.customs;
  report.geometries = plan.geometries;
  report.pairs = counts.pairs;
  report.dropped_not_finite = counts.dropped[kNotFinite];
  report.dropped_degenerate = counts.dropped[kDegenerate];
  report.bad_indices = counts.dropped[kBadIndex];
  report.status = too_deep                  ? BuildStatus::kTooDeep
                  : too_large               ? BuildStatus::kTooLarge
                  : report.bad_indices != 0 ? BuildStatus::kBadIndex
                                            : BuildStatus::kOk;
  report.builder = state->too_deep != 0 ? Builder::kLbvh : plan.builder;
  *plan.report = report;
}

/// The parents of a file's nodes, and then the nodes' boxes from the leaves up, for layouts that have not got them yet.
template <class Layout>
__global__ void __launch_bounds__(kBlock) link_up(RefitFile<Layout> file, const BuildReport* report) {
  const std::uint32_t i = thread_index();
  if (i < report->nodes && report->view.root != kInvalidRef) LinkUpStep<Layout>{file}(i);
}
template <class Layout>
__global__ void __launch_bounds__(kBlock) encode_nodes(RefitFile<Layout> file, const BuildReport* report) {
  const std::uint32_t i = thread_index();
  if (i < report->nodes && report->view.root != kInvalidRef) RefitNodeStep<Layout>{file}(i);
}
/// The bounds that the root's bytes state.
template <class Layout> __global__ void widen_bounds(RefitFile<Layout> file, BuildReport* report) {
  if (report->nodes == 0 || report->view.root == kInvalidRef) return;
  const Box box = bounded(node_box<Layout>(file.nodes[0]), file.header->bounds);
  file.header->bounds = box;
  report->view.bounds = box;
}

}  // namespace hiprt::build::kernels
