#pragma once
/// Kernels that begin and end a build on a GPU. Those of its steps lie in the folders of the algorithms. Internal.

#include <hiprt_build/format/file_layout.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/pipeline/gpu_state.h>
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
  state->nodes = 0;
  state->too_deep = 0;
  state->bad_node = kInvalidId;
  state->missing = 0;
  state->stack_need = 0;
  state->demand = SplitDemand{};
}

static __global__ void put_geometries(GeometryChunk chunk, std::uint32_t begin, std::uint32_t count,
                                      GeometryView* views, GeometryRecord* records) {
  const std::uint32_t i = thread_index();
  if (i >= count) return;
  const GeometryView view = chunk.views[i];
  views[begin + i] = view;
  records[begin + i] = GeometryRecord{view.first, view.primitive_count, 0, view.mask, view.flags};
}

static __global__ void note_whole(BuildState* state) { state->whole = state->counts.leaves; }

static __global__ void __launch_bounds__(kBlock)
    list_primitives(const Reference* references, std::uint32_t count, LeafPrimitives* primitives) {
  const std::uint32_t i = thread_index();
  if (i < count) primitives[i] = LeafPrimitives{references[i].primitive, references[i].contents};
}

/// Offsets in the output.
struct OutputPlan {
  std::byte* base;
  SectionEntry sections[kTreeSections];
  std::uint64_t size;  ///< Bytes of the file; the report lies behind.
  BuildReport* report;
  NodeLayout layout;
  Builder builder;
  std::uint32_t geometries, primitives;

  __device__ const GeometryRecord* records() const {
    return reinterpret_cast<const GeometryRecord*>(base + sections[kGeometriesAt].offset);
  }
};

/// Whether layout quantized can hold it; the empty box can.
HIPRT_HD inline bool is_quantizable(const Box& box) {
  for (unsigned axis = 0; axis < 3; ++axis)
    if (box.min[axis] <= -kQuantizedLimit || box.max[axis] >= kQuantizedLimit) return false;
  return true;
}

/// What the header and the report of a build say of its tree.
struct FinishedTree {
  NodeRef root;
  std::uint32_t nodes;
  FeatureMask features;
  bool too_deep, too_large;
};

inline __device__ FeatureMask find_features(const OutputPlan& plan, const BuildState& state) {
  const GroupCounts& counts = state.counts;
  FeatureMask features = 0;
  if (counts.leaves > counts.customs) features |= feature_bit(Feature::kTriangles);
  if (counts.customs != 0) features |= feature_bit(Feature::kCustom);
  if (counts.leaves > state.whole) features |= feature_bit(Feature::kSplitReferences);
  for (std::uint32_t i = 0; i < plan.geometries; ++i)
    if (plan.records()[i].mask != 0xffffffffu) features |= feature_bit(Feature::kMasks);
  return features;
}

/// Of a complete binary tree.
static __global__ void count_nodes(const CollapsePlan* plans, BuildState* state) {
  const bool inner = state->counts.leaves != 0 && (state->root & kLinkedLeaf) == 0;
  state->nodes = inner && !plans[state->root].is_run() ? plans[state->root].nodes : 0;
}

inline __device__ FinishedTree finish_tree(const OutputPlan& plan, const BuildState& state) {
  const GroupCounts& counts = state.counts;
  const bool is_run = counts.leaves != 0 && state.nodes == 0;
  FinishedTree tree{kInvalidRef, state.nodes, find_features(plan, state), state.stack_need > kMaxStackBound,
                    plan.layout == NodeLayout::kQuantized && !is_quantizable(state.bounds.get())};
  if (is_run && !tree.too_large)
    tree.root = make_ref(plan.sections[kLeavesAt].offset,
                         counts.customs == counts.leaves ? NodeType::kProcedural : NodeType::kTriangle0);
  else if (tree.nodes != 0 && !tree.too_deep && !tree.too_large)
    tree.root = make_ref(plan.sections[kNodesAt].offset,
                         plan.layout == NodeLayout::kHalf ? NodeType::kBox16 : NodeType::kBox32);
  return tree;
}

inline __device__ void write_head(OutputPlan& plan, const FinishedTree& tree, const BuildState& state) {
  FileHeader header{};
  for (unsigned i = 0; i < sizeof(kMagic); ++i) header.magic[i] = "HIPRTBVH"[i];
  header.version_major = kVersionMajor;
  header.version_minor = kVersionMinor;
  header.layout = static_cast<std::uint32_t>(plan.layout);
  header.features = tree.features;
  header.byte_size = plan.size;
  header.section_count = kTreeSections;
  header.root = tree.root;
  header.stack_bound = state.stack_need;
  header.geometry_count = plan.geometries;
  header.bounds = state.bounds.get();
  header.primitive_count = plan.primitives;
  *reinterpret_cast<FileHeader*>(plan.base) = header;
  SectionEntry& nodes = plan.sections[kNodesAt];
  const NodePlaces places(nodes, plan.layout);
  nodes.count = places.count(tree.nodes);
  nodes.stride = places.stride(tree.nodes);
  plan.sections[kLeavesAt].count = state.counts.leaves;
  for (unsigned i = 0; i < kTreeSections; ++i)
    reinterpret_cast<SectionEntry*>(plan.base + sizeof(FileHeader))[i] = plan.sections[i];
}

/// Writes header, section table and report.
static __global__ void finish(OutputPlan plan, const BuildState* state) {
  const GroupCounts& counts = state->counts;
  const FinishedTree tree = finish_tree(plan, *state);
  write_head(plan, tree, *state);
  BuildReport report;
  report.view.base = plan.base;
  report.view.size = plan.size;
  report.view.geometries = plan.records();
  report.view.root = tree.root;
  report.view.stack_bound = state->stack_need;
  report.view.features = tree.features;
  report.view.layout = plan.layout;
  report.view.bounds = state->bounds.get();
  report.nodes = tree.nodes;
  report.leaves = counts.leaves;
  report.custom_leaves = counts.customs;
  report.geometries = plan.geometries;
  report.pairs = counts.pairs;
  report.dropped_not_finite = counts.dropped[kNotFinite];
  report.dropped_degenerate = counts.dropped[kDegenerate];
  report.bad_indices = counts.dropped[kBadIndex];
  report.missing = state->missing;
  report.bad_node = state->bad_node == kInvalidId ? 0 : state->bad_node;
  report.status = state->bad_node != kInvalidId ? BuildStatus::kBadTree
                  : tree.too_deep               ? BuildStatus::kTooDeep
                  : tree.too_large              ? BuildStatus::kTooLarge
                  : report.bad_indices != 0     ? BuildStatus::kBadIndex
                                                : BuildStatus::kOk;
  report.builder = state->too_deep != 0 ? Builder::kLbvh : plan.builder;
  *plan.report = report;
}

}  // namespace hiprt::build::kernels
