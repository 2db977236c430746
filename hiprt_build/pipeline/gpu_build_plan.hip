#include <hiprt_build/pipeline/gpu_build_plan.h>

#include <hiprt_build/pipeline/gpu_geometry.h>

#include <hiprt_build/exchange/gpu_import.h>
#include <hiprt_build/input/builder_defaults.h>
#include <hiprt_build/input/check_options.h>
#include <hiprt_build/input/references.h>
#include <hiprt_build/lbvh_ploc/gpu_ploc.h>
#include <hiprt_build/pipeline/gpu_check_options.h>
#include <hiprt_build/presplit/gpu_presplit.h>
#include <hiprt_build/reinsert/gpu_reinsert.h>
#include <hiprt_build/sah_sbvh/gpu_top_down.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using build::Builder;
using build::KeptCluster;
using build::LeafPrimitives;
using build::LinkedNode;
using build::Reference;

/// @return the number of all primitives.
Result<std::uint32_t> check_geometries(std::span<const DeviceGeometry> geometries) {
  if (geometries.size() > kMaxGeometries)
    return fail(ErrorCode::kTooLarge, geometries.size(), " geometries, a file names at most ", kMaxGeometries);
  std::uint64_t primitives = 0;
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    const DeviceGeometry& geometry = geometries[i];
    primitives += geometry.primitive_count;
    if (auto checked = check_arrays(geometry, i); !checked) return tl::unexpected(std::move(checked.error()));
  }
  if (primitives > kMaxBuildPrimitives)
    return fail(ErrorCode::kTooLarge, primitives, " primitives, the limit is ", kMaxBuildPrimitives);
  return static_cast<std::uint32_t>(primitives);
}

bool has_customs(std::span<const DeviceGeometry> geometries) {
  return std::any_of(geometries.begin(), geometries.end(), [](const DeviceGeometry& geometry) {
    return geometry.boxes != nullptr && geometry.primitive_count != 0;
  });
}

/// @return how many references there may be after splits.
std::uint32_t capacity_after(std::uint32_t count, double budget) {
  return budget > 1.0 ? static_cast<std::uint32_t>(build::split_capacity(count, budget)) : count;
}

/// Of the stages that run one after the other the largest.
std::uint64_t stage_scratch(const BuildPlan& plan, bool split, bool rest) {
  std::uint64_t most = 0;
  const auto need = [&](std::uint64_t bytes) { most = std::max(most, bytes); };
  if (split) {
    if (plan.presplits()) need(presplit_scratch(plan.primitives, plan.pieces));
    if (plan.from_top())
      need(top_down_scratch(plan.references(), plan.slots, plan.tuning(), defaults_of(plan.builder).splits));
  }
  if (!rest) return most;
  if (plan.gapped()) need(compact_tree_scratch(plan.slots));
  if (plan.builder == Builder::kPloc) need(ploc_scratch(plan.capacity));
  if (plan.finishes()) need(finish_tree_scratch(plan.capacity, plan.rounds));
  if (plan.imports()) {
    Arena arena;
    build::GpuImport job{};
    build::GpuImport::take(arena, plan.primitives, plan.imported_leaves, job);
    need(arena.size());
  }
  return most;
}

/// Pairs are the caller's, and a pair may need two leaves.
void plan_import(BuildPlan& plan, std::span<const DeviceGeometry> geometries, std::uint32_t leaves) {
  plan.builder = Builder::kImported;
  plan.imported_leaves = leaves;
  plan.pairs = geometries[0].pairs != nullptr && geometries[0].pair_count != 0;
  plan.presplit_budget = plan.split_budget = 1.0;
  plan.whole = plan.pieces = plan.primitives;
  plan.slots = plan.capacity = plan.wide = plan.pairs ? 2 * leaves : leaves;
}

struct Transient {
  Reference* references;
  EdgeTableScratch pairing;
  GappedTree gapped;
  TreeScratch tree;
};

/// What is needed until the binary tree is complete. Pairing is over before the tree begins.
Transient take_transient(Arena& arena, const BuildPlan& plan, const TreeMemory& tree) {
  auto* references = arena.take<Reference>(plan.primitives);
  Arena before = arena;
  const EdgeTableScratch pairing = plan.pairs ? EdgeTableScratch::take(before, plan.primitives) : EdgeTableScratch{};
  const GappedTree gapped = plan.gapped() ? GappedTree::take(arena, plan.slots) : GappedTree{};
  const TreeScratch scratch(arena, plan, tree, true, true);
  arena.skip(before);
  return {references, pairing, gapped, scratch};
}

/// What is wrong with a stride, or nothing.
std::string stride_fault(const char* name, std::uint32_t stride, std::size_t element) {
  if (stride % 4 == 0 && stride >= element) return {};
  return std::string(name) + " of " + std::to_string(stride) + " bytes; it must be a multiple of 4, at least " +
         std::to_string(element);
}

std::string fault_of(const DeviceGeometry& geometry) {
  const bool indices = geometry.implicit_triangles ? geometry.triangles == nullptr : geometry.triangles != nullptr;
  const bool mesh = geometry.positions != nullptr && indices && geometry.boxes == nullptr;
  const bool custom = geometry.boxes != nullptr && geometry.positions == nullptr && geometry.triangles == nullptr;
  if (geometry.type > kMaxGeometryType)
    return "type " + std::to_string(geometry.type) + ", the limit is " + std::to_string(kMaxGeometryType);
  if (geometry.primitive_count == 0) {
    if (geometry.boxes == nullptr && !geometry.implicit_triangles && geometry.position_count != 0)
      return std::to_string(geometry.position_count) +
             " positions but no triangles; give triangles, or set implicit_triangles";
    return {};
  }
  if (!mesh && !custom)
    return std::to_string(geometry.primitive_count) +
           " primitives need positions and triangles, positions with implicit_triangles, or boxes alone";
  if (geometry.implicit_triangles && std::uint64_t{3} * geometry.primitive_count != geometry.position_count)
    return std::to_string(geometry.primitive_count) + " implicit triangles need three times as many positions, not " +
           std::to_string(geometry.position_count);
  if (custom) {
    constexpr std::uint32_t kCorner = sizeof(float[3]);
    if (geometry.box_upper % 4 != 0 || geometry.box_upper < kCorner || geometry.box_stride < kCorner ||
        geometry.box_upper > geometry.box_stride - kCorner)
      return "box_upper of " + std::to_string(geometry.box_upper) + " bytes; it must be a multiple of 4, from 12 to " +
             "box_stride - 12";
    return stride_fault("box_stride", geometry.box_stride, sizeof(Box));
  }
  if (const std::string fault = stride_fault("triangle_stride", geometry.triangle_stride, sizeof(build::Triangle));
      !fault.empty())
    return fault;
  return stride_fault("position_stride", geometry.position_stride, sizeof(build::Position));
}

}  // namespace

Result<void> check_arrays(const DeviceGeometry& geometry, std::size_t i) {
  const std::string fault = fault_of(geometry);
  if (fault.empty()) return {};
  return fail(ErrorCode::kInvalidInput, "geometry ", i, ": ", fault);
}

TreeMemory::TreeMemory(Arena& arena, const BuildPlan& plan) {
  const std::uint32_t n = plan.capacity;
  primitives = arena.take<LeafPrimitives>(n);
  progress = arena.take<build::kernels::GridProgress>(1);
  Arena before = arena;
  nodes = arena.take<LinkedNode>(n);
  plans = arena.take<build::CollapsePlan>(n);
  if (plan.sorts()) {
    for (unsigned i = 0; i < 2; ++i) {
      sort.keys[i] = before.take<std::uint64_t>(plan.keys());
      sort.values[i] = before.take<std::uint32_t>(plan.keys());
    }
    sort_temp = before.take<std::byte>(plan.sort_bytes);
    if (plan.packs()) pack_words = before.take<std::uint64_t>(gpu::pack_words(plan));
  }
  arena.skip(before);
  if (!plan.splits()) return;
  leaves = arena.take<Reference>(n);
  if (plan.layout == NodeLayout::kHalf || plan.layout == NodeLayout::kQuantized) leaf_boxes = arena.take<Box>(n);
}

TreeScratch::TreeScratch(Arena& arena, const BuildPlan& plan, const TreeMemory& tree, bool split, bool rest) {
  const std::uint32_t n = plan.pieces;
  if (split && plan.presplits()) parts = arena.take<Reference>(n);
  if (rest) {
    sorted.references = plan.splits() ? tree.leaves : arena.take<Reference>(n);
    sorted.primitives = tree.primitives;
    if (plan.sorts()) {
      sorted.levels = arena.take<std::uint8_t>(n);
      sorted.met = arena.take<std::uint32_t>(n);
      if (plan.builder == Builder::kHploc) kept = arena.take<KeptCluster>(n);
    }
  }
  stage = arena.take<std::byte>(stage_scratch(plan, split, rest));
}

Layouts::Layouts(const BuildPlan& build_plan)
    : plan(build_plan), file(tree_layout(plan.layout, {plan.wide, plan.capacity, plan.primitives, plan.geometries})) {
  report = align_up(file.byte_size(), kDeviceAlignment);
  Arena arena, kept_arena;
  Head(kept_arena, plan);
  const TreeMemory tree(kept_arena, plan);
  take_transient(arena, plan, tree);
  transient = arena.size();
  kept = kept_arena.size();
  transient_in_output = transient_offset() + transient <= file[kPrimitiveMapAt].offset;
}

BuildMemory Layouts::memory(std::byte* output, std::byte* scratch) const {
  Arena transient_arena(transient_in_output ? output + transient_offset() : scratch + kept), kept_arena(scratch);
  const Head head(kept_arena, plan);
  const TreeMemory tree(kept_arena, plan);
  const Transient parts = take_transient(transient_arena, plan, tree);
  return {head, parts.references, parts.pairing, parts.gapped, tree, parts.tree};
}

BuildOutput Layouts::output(std::byte* base) const {
  return {base, file, reinterpret_cast<GeometryRecord*>(base + file[kGeometriesAt].offset),
          reinterpret_cast<BuildReport*>(base + report)};
}

std::uint64_t pack_words(const BuildPlan& plan) {
  return std::uint64_t{plan.primitives} / build::kernels::kPackTile + 2;
}

Result<void> plan_leaves(BuildPlan& plan, std::uint32_t leaves, bool counted) {
  plan.whole = leaves;
  plan.counted = counted;
  plan.pieces = capacity_after(leaves, plan.presplit_budget);
  plan.slots = plan.from_top() ? capacity_after(plan.pieces, plan.split_budget) : plan.pieces;
  plan.capacity = plan.wide = plan.slots;
  build::SortBuffers none{};
  if (!plan.sorts()) return {};
  return build::sort_pairs(nullptr, plan.sort_bytes, none, plan.keys(), nullptr);
}

Result<BuildPlan> plan_memory(std::span<const DeviceGeometry> geometries, const BuildOptions& wanted,
                              std::uint32_t imported_leaves) {
  if (auto checked = check_options(wanted); !checked) return tl::unexpected(std::move(checked.error()));
  const BuildOptions options = build::with_defaults(wanted);
  const auto primitives = check_geometries(geometries);
  if (!primitives) return tl::unexpected(primitives.error());
  const bool whole = has_customs(geometries);
  BuildPlan plan;
  plan.primitives = *primitives;
  plan.geometries = geometries.size();
  plan.builder = options.builder;
  plan.layout = options.nodes;
  plan.pairs = options.pair_triangles && options.max_leaf_triangles > 1;
  plan.presplit_budget = whole ? 1.0 : options.presplit_budget;
  plan.split_budget = whole || options.builder == Builder::kSah ? 1.0 : *options.split_budget;
  plan.rounds = *options.reinsertion_rounds;
  plan.usual_rounds = !wanted.reinsertion_rounds;
  plan.radius = options.ploc_radius;
  if (imported_leaves != 0)
    plan_import(plan, geometries, imported_leaves);
  else if (auto planned = plan_leaves(plan, plan.primitives, false); !planned)
    return tl::unexpected(std::move(planned.error()));
  return plan;
}

Result<Layouts> plan_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                           std::uint32_t imported_leaves) {
  const auto plan = plan_memory(geometries, options, imported_leaves);
  if (!plan) return tl::unexpected(plan.error());
  const Layouts layouts(*plan);
  if (layouts.file[kPrimitiveMapAt].offset > kAddressLimit)
    return fail(ErrorCode::kTooLarge, plan->primitives, " primitives: their nodes and leaves may end at byte ",
                layouts.file[kPrimitiveMapAt].offset, ", a node reference addresses ", kAddressLimit,
                ". A smaller split_budget or presplit_budget reserves less; BuildSteps reserves what is needed");
  return layouts;
}

Result<void> check_options(const BuildOptions& options) {
  if (auto checked = build::check_ranges(options); !checked) return checked;
  if (options.builder > Builder::kHq)
    return fail(ErrorCode::kInvalidInput, "builder ", build::name(options.builder), " does not run on the GPU");
  return {};
}

Result<BuildSizes> build_sizes(std::span<const DeviceGeometry> geometries, const BuildOptions& options) {
  const auto layouts = plan_build(geometries, options);
  if (!layouts) return tl::unexpected(layouts.error());
  return layouts->sizes();
}

}  // namespace hiprt::gpu
