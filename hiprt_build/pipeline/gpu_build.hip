#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/import.h>

#include <hiprt_build/encode/gpu_encode_kernels.h>
#include <hiprt_build/exchange/gpu_import_kernels.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/input/builder_defaults.h>
#include <hiprt_build/lbvh_ploc/gpu_climb_kernels.h>
#include <hiprt_build/lbvh_ploc/gpu_ploc.h>
#include <hiprt_build/pair/given_pairs.h>
#include <hiprt_build/pair/gpu_pair_kernels.h>
#include <hiprt_build/pipeline/gpu_build_plan.h>
#include <hiprt_build/pipeline/gpu_geometry.h>
#include <hiprt_build/pipeline/gpu_kernels.h>
#include <hiprt_build/presplit/gpu_presplit.h>
#include <hiprt_build/reinsert/gpu_reinsert.h>
#include <hiprt_build/sah_sbvh/gpu_top_down.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Builder;
using build::Reference;
using build::SortBuffers;
using build::WideWriter;

/// One build on its kind into a stream.
class Enqueuer {
 public:
  /// @param imported of a plan that imports.
  Enqueuer(const Layouts& layouts, const BuildOptions& options, const DeviceTree& imported, std::byte* output,
           std::byte* scratch, hipStream_t stream)
      : layouts_(layouts),
        plan_(layouts.plan),
        options_(options),
        imported_(imported),
        output_(output),
        steps_(stream),
        transient_pieces_(layouts.transient_in_output ? output + layouts.transient_offset() : scratch + layouts.kept),
        kept_pieces_(scratch),
        transient_(transient_pieces_, plan_),
        kept_(kept_pieces_, plan_),
        references_(transient_.references) {
    transient_.sorted.primitives = kept_.primitives;
    if (plan_.splits()) transient_.sorted.references = kept_.leaves;
    geometries_ = {kept_.geometries, static_cast<std::uint32_t>(plan_.geometries), plan_.primitives};
  }

  Result<void> run(std::span<const DeviceGeometry> geometries) {
    ask("pair", 0.0);
    steps_.one("start", start, kept_.state);
    put(geometries);
    if (plan_.primitives != 0) {
      pair(geometries);
      if (plan_.splits()) steps_.one("note_whole", note_whole, kept_.state);
      if (plan_.presplits()) presplit();
      if (plan_.imports())
        adopt(geometries[0]);
      else
        plan_.from_top() ? split() : join();
      ask("collapse", 0.8);
      dispatch_layout(plan_.layout, [&](auto layout) { write<decltype(layout)>(); });
    }
    ask("encode", 0.9);
    const OutputPlan plan = output_plan();
    steps_.one("finish", finish, plan, kept_.plans, kept_.state);
    if (plan_.primitives != 0)
      dispatch_layout(plan_.layout, [&](auto layout) {
        encode<decltype(layout)>(plan.report);
        widen<decltype(layout)>(plan.report);
      });
    return steps_.result();
  }

 private:
  /// Whether to go on, once the device is here.
  void ask(const char* step, double fraction) {
    if (!options_.progress) return;
    steps_.then([&] { return check(hipStreamSynchronize(steps_.stream()), "hipStreamSynchronize", step); });
    steps_.then([&]() -> Result<void> {
      if (options_.progress(build::Progress{step, fraction})) return {};
      return fail(ErrorCode::kCancelled, "the build was cancelled before step ", step);
    });
  }

  template <class T> T* section(TreeSection i) const { return reinterpret_cast<T*>(output_ + layouts_.file[i].offset); }

  /// By kernel arguments: no memory of the host's has to live on.
  void put(std::span<const DeviceGeometry> geometries) {
    std::uint32_t first = 0;
    for (std::size_t begin = 0; begin < geometries.size(); begin += GeometryChunk::kSize) {
      const std::size_t count = std::min<std::size_t>(GeometryChunk::kSize, geometries.size() - begin);
      GeometryChunk chunk{};
      for (std::size_t i = 0; i < count; ++i) {
        chunk.views[i] = view_of(geometries[begin + i]);
        chunk.views[i].first = first;
        first += geometries[begin + i].primitive_count;
      }
      steps_.blocks("put_geometries", GeometryChunk::kSize, 1, put_geometries, chunk, static_cast<std::uint32_t>(begin),
                    static_cast<std::uint32_t>(count), kept_.geometries, section<GeometryRecord>(kGeometriesAt));
    }
  }

  void pair(std::span<const DeviceGeometry> geometries) {
    const std::uint32_t n = plan_.primitives;
    steps_.fill_bytes("the primitive map", section<std::uint32_t>(kPrimitiveMapAt), n, 0xff);
    const std::uint64_t windows = (n - 1) / build::kPairWindow + 1;
    steps_.persistent("pair_primitives", kGroupBlock, (windows - 1) / kGroupsPerBlock + 1, pair_primitives,
                      {geometries_, plan_.pairs}, transient_.references, transient_.pairing.singles,
                      section<GeometryRecord>(kGeometriesAt), kept_.state);
    if (!plan_.pairs) return;
    pair_as_given(geometries);
    if (plan_.imports()) return;
    steps_.then([&] {
      return enqueue_pair_by_edges(geometries_, transient_.references, transient_.pairing, kept_.state,
                                   steps_.stream());
    });
  }

  /// The claims of triangles lie where the table of edges will be.
  void pair_as_given(std::span<const DeviceGeometry> geometries) {
    const auto claims = reinterpret_cast<std::uint32_t*>(transient_.pairing.table);
    std::uint32_t first = 0;
    for (std::size_t g = 0; g < geometries.size(); first += geometries[g++].primitive_count) {
      const DeviceGeometry& geometry = geometries[g];
      if (geometry.pairs == nullptr || geometry.pair_count == 0 || geometry.primitive_count == 0) continue;
      const build::GivenPairs pairs{view_of(geometry), first, geometry.pairs, geometry.pair_count, claims};
      steps_.fill_bytes("claims", claims, geometry.primitive_count, 0xff);
      steps_.each(geometry.pair_count, "claim_pairs", claim_pairs, pairs);
      steps_.each(geometry.pair_count, "join_pairs", join_pairs, pairs, transient_.references, kept_.state);
    }
  }

  void presplit() {
    ask("cut", 0.1);
    references_ = transient_.parts;
    steps_.then([&] {
      return enqueue_presplit(
          {geometries_, transient_.references, plan_.primitives, plan_.pieces, plan_.presplit_budget, kept_.state},
          transient_.parts, transient_.stage, steps_.stream());
    });
  }

  build::PlannedTree tree() const {
    const build::SahCosts& costs = options_.costs;
    return {{transient_.sorted.references},
            kept_.nodes,
            {kept_.plans,
             transient_.sorted.references,
             {costs.box_node, costs.leaf, costs.custom, options_.max_leaf_triangles}},
            &kept_.state->root};
  }

  /// The tree from the root down.
  void split() {
    ask("split", 0.2);
    BuildState* const state = kept_.state;
    steps_.then([&] {
      return enqueue_top_down({geometries_, references_, plan_.pieces, plan_.capacity, plan_.split_budget,
                               plan_.split_budget > 1.0, build::defaults_of(plan_.builder).least_overlap},
                              {transient_.sorted.references, kept_.nodes, &state->root, &state->counts.leaves},
                              transient_.stage, steps_.stream(), plan_.tuning());
    });
    steps_.each(plan_.capacity, "list_primitives", list_primitives, transient_.sorted.references, plan_.capacity,
                kept_.primitives);
    finish_tree();
  }

  /// The caller's tree.
  void adopt(const DeviceGeometry& geometry) {
    ask("import", 0.2);
    const std::uint32_t leaves = plan_.imported_leaves;
    Arena arena(transient_.stage);
    build::GpuImport job{};
    build::GpuImport::take(arena, plan_.primitives, leaves, job);
    job.tree = imported_;
    job.pairs = plan_.pairs ? geometry.pairs : nullptr;
    job.pair_count = geometry.pair_count;
    job.primitives = plan_.primitives;
    job.references = transient_.references;
    job.leaves = transient_.sorted.references;
    job.nodes = kept_.nodes;
    steps_.one("start_import", start_import, kept_.state);
    steps_.fill_bytes("uses", job.uses, plan_.primitives, 0);
    steps_.fill_bytes("parents", job.parents, 2 * std::uint64_t{leaves}, 0xff);
    steps_.fill_bytes("arrivals", job.met, leaves, 0);
    steps_.fill_bytes("leaves below", job.below, leaves, 0);
    steps_.fill_bytes("nodes", job.nodes, plan_.capacity, 0xff);
    steps_.each(leaves, "count_uses", count_uses, job, kept_.state);
    steps_.each(leaves, "link_children", link_children, job, kept_.state);
    steps_.each(leaves, "make_leaves", make_leaves, job, kept_.state);
    steps_.each(leaves, "splice", splice, job, kept_.state);
    steps_.each(plan_.capacity, "drop_bad_tree", drop_bad_tree, job, kept_.state);
    steps_.one("end_import", end_import, kept_.state);
    steps_.each(plan_.primitives, "count_missing", count_missing, job, geometries_,
                section<GeometryRecord>(kGeometriesAt), kept_.state);
    steps_.each(plan_.capacity, "list_primitives", list_primitives, transient_.sorted.references, plan_.capacity,
                kept_.primitives);
    finish_tree();
  }

  /// The tree from the leaves up.
  void join() {
    const std::uint32_t n = plan_.pieces;
    ask("sort", 0.2);
    sort();
    ask("tree", 0.3);
    if (plan_.finishes()) steps_.fill_bytes("nodes", kept_.nodes, n, 0xff);
    if (plan_.builder == Builder::kPloc) {
      steps_.then([&] {
        return enqueue_ploc({transient_.sorted.references, &kept_.state->counts.leaves, n, plan_.radius},
                            {kept_.nodes, &kept_.state->root}, transient_.stage, steps_.stream());
      });
    } else if (plan_.builder == Builder::kHploc) {
      steps_.then([&] {
        return launch(climb_hploc, std::uint64_t{n}, steps_.stream(), {.block = kGroupBlock, .name = "climb_hploc"},
                      tree(), transient_.sorted, transient_.kept, plan_.radius, kept_.state);
      });
    } else {
      steps_.each(n, "climb_lbvh", climb_lbvh, tree(), transient_.sorted, kept_.state);
    }
    if (plan_.finishes()) finish_tree();
    if (plan_.builder == Builder::kLbvh || plan_.builder == Builder::kLbvh30) return;
    steps_.each(n, "check_depth", check_depth, kept_.plans, transient_.sorted, kept_.state);
    steps_.each(n, "lbvh_again", lbvh_again, tree(), transient_.sorted, kept_.state);
  }

  void sort() {
    const std::uint32_t n = plan_.pieces;
    SortBuffers& buffers = transient_.sort;
    const unsigned bits = plan_.builder == Builder::kLbvh30 ? build::kMortonBits30 : build::kMortonBits63;
    if (plan_.presplits()) {
      // Parts have other centres than their triangles.
      steps_.one("clear_centers", clear_centers, kept_.state);
      steps_.persistent("bound_centers", kBlock, (n - 1) / kBlock + 1, bound_centers, references_, n, kept_.state);
    }
    steps_.each(n, "make_keys", make_keys, references_, n, bits, kept_.state, buffers.keys[0], buffers.values[0]);
    std::size_t bytes = plan_.sort_bytes;
    steps_.then([&] { return build::sort_pairs(transient_.sort_temp, bytes, buffers, n, steps_.stream()); });
    steps_.each(n, "gather_leaves", gather_leaves, references_, buffers.keys[buffers.current],
                buffers.values[buffers.current], kept_.state, transient_.sorted);
  }

  void finish_tree() {
    ask("reinsert", 0.5);
    steps_.then([&] {
      return enqueue_finish_tree({tree(), plan_.capacity, plan_.rounds}, transient_.stage, steps_.stream());
    });
  }

  template <class Layout> void write() {
    const WideWriter<Layout> writer{geometries_,
                                    kept_.nodes,
                                    kept_.plans,
                                    kept_.primitives,
                                    section<typename Layout::Node>(kNodesAt),
                                    section<typename Layout::Leaf>(kLeavesAt),
                                    section<std::uint32_t>(kPrimitiveMapAt),
                                    layouts_.file[kNodesAt].offset,
                                    layouts_.file[kLeavesAt].offset,
                                    kept_.leaves,
                                    kept_.leaf_boxes};
    const build::WideQueue queue{kept_.plans};
    steps_.each(plan_.capacity, "begin_wide_tree", begin_wide_tree<Layout>, writer, queue, kept_.state);
    // A team of four lanes for each node at most.
    steps_.persistent("write_wide_tree", kBlock, (std::uint64_t{plan_.capacity} * 4 - 1) / kBlock + 1,
                      write_wide_tree<Layout>, writer, queue, kept_.state);
  }

  /// Overwrites the linked tree.
  template <class Layout> void encode(BuildReport* report) {
    if constexpr (!WideWriter<Layout>::kBoxesApart) {
      build::RefitFile<Layout> file{};
      file.header = reinterpret_cast<FileHeader*>(output_);
      file.nodes = section<typename Layout::Node>(kNodesAt);
      file.leaves = section<typename Layout::Leaf>(kLeavesAt);
      file.first_node = layouts_.file[kNodesAt].offset;
      file.first_leaf = layouts_.file[kLeavesAt].offset;
      file.parents = reinterpret_cast<std::uint32_t*>(kept_.nodes);
      file.leaf_boxes = kept_.leaf_boxes;
      steps_.each(plan_.capacity, "link_up", link_up<Layout>, file, report);
      steps_.each(plan_.capacity, "encode_nodes", encode_nodes<Layout>, file, report);
      steps_.one("widen_bounds", widen_bounds<Layout>, file, report);
    }
  }

  template <class Layout> void widen(BuildReport* report) {
    if constexpr (may_be_widened(Layout::kId)) {
      if (!options_.widen_boxes) return;
      auto* header = reinterpret_cast<FileHeader*>(output_);
      auto* nodes = section<typename Layout::Node>(kNodesAt);
      steps_.one("widen_header", widen_header, header, report);
      steps_.each(plan_.capacity, "widen_nodes", widen_nodes<Layout>, build::WidenNodeStep<Layout>{nodes, header},
                  report);
      steps_.one("widen_view", widen_view<Layout>, build::WidenBoundsStep<Layout>{header, nodes}, report);
    }
  }

  OutputPlan output_plan() const {
    OutputPlan plan{};
    plan.base = output_;
    std::copy_n(layouts_.file.begin(), kTreeSections, plan.sections);
    plan.size = layouts_.file.byte_size();
    plan.report = reinterpret_cast<BuildReport*>(output_ + layouts_.report);
    plan.layout = plan_.layout;
    plan.builder = plan_.builder;
    plan.geometries = static_cast<std::uint32_t>(plan_.geometries);
    plan.primitives = plan_.primitives;
    return plan;
  }

  const Layouts& layouts_;
  const BuildPlan& plan_;
  const BuildOptions& options_;
  const DeviceTree& imported_;
  std::byte* output_;
  Launcher steps_;
  Arena transient_pieces_, kept_pieces_;
  Transient transient_;
  Kept kept_;
  const Reference* references_;  ///< That the tree is to be built of.
  build::GeometryTable geometries_{};
};

Result<void> check_memory(const char* function, const std::byte* output, const std::byte* scratch) {
  for (const std::byte* memory : {output, scratch})
    if (memory == nullptr || reinterpret_cast<std::uintptr_t>(memory) % kDeviceAlignment != 0)
      return fail(ErrorCode::kInvalidInput, function, ": output and scratch must be aligned to ", kDeviceAlignment,
                  " bytes");
  return {};
}

Result<Layouts> plan_import(const DeviceGeometry& geometry, const DeviceTree& tree, const BuildOptions& wanted) {
  if (geometry.primitive_count == 0) return plan_build({&geometry, 1}, wanted);
  if (tree.leaf_count == 0 || tree.leaf_count > kMaxBuildPrimitives)
    return fail(ErrorCode::kInvalidInput, "import: a tree of ", tree.leaf_count, " leaves over ",
                geometry.primitive_count, " primitives; it must have 1 to ", kMaxBuildPrimitives);
  if (tree.leaves == nullptr || (tree.nodes == nullptr && tree.leaf_count > 1))
    return fail(ErrorCode::kInvalidInput, "import: nodes and leaves must not be nullptr");
  BuildOptions options = wanted;
  options.builder = Builder::kHploc;
  options.presplit_budget = 1.0;
  options.split_budget.reset();
  if (!options.reinsertion_rounds) options.reinsertion_rounds = 0;
  return plan_build({&geometry, 1}, options, tree.leaf_count);
}

Result<const BuildReport*> enqueue(const Layouts& layouts, std::span<const DeviceGeometry> geometries,
                                   const BuildOptions& options, const DeviceTree& tree, std::byte* output,
                                   std::byte* scratch, hipStream_t stream) {
  Enqueuer enqueuer(layouts, options, tree, output, scratch, stream);
  if (auto started = enqueuer.run(geometries); !started) return tl::unexpected(std::move(started.error()));
  return reinterpret_cast<const BuildReport*>(output + layouts.report);
}

}  // namespace

Result<const BuildReport*> enqueue_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                                         std::byte* output, std::byte* scratch, hipStream_t stream) {
  const auto layouts = plan_build(geometries, options);
  if (!layouts) return tl::unexpected(layouts.error());
  if (auto memory = check_memory("enqueue_build", output, scratch); !memory)
    return tl::unexpected(std::move(memory.error()));
  return enqueue(*layouts, geometries, options, DeviceTree{}, output, scratch, stream);
}

Result<BuildSizes> import_sizes(const DeviceGeometry& geometry, const DeviceTree& tree, const BuildOptions& options) {
  const auto layouts = plan_import(geometry, tree, options);
  if (!layouts) return tl::unexpected(layouts.error());
  return layouts->sizes();
}

Result<const BuildReport*> enqueue_import(const DeviceGeometry& geometry, const DeviceTree& tree,
                                          const BuildOptions& options, std::byte* output, std::byte* scratch,
                                          hipStream_t stream) {
  const auto layouts = plan_import(geometry, tree, options);
  if (!layouts) return tl::unexpected(layouts.error());
  if (auto memory = check_memory("enqueue_import", output, scratch); !memory)
    return tl::unexpected(std::move(memory.error()));
  return enqueue(*layouts, {&geometry, 1}, options, tree, output, scratch, stream);
}

}  // namespace hiprt::gpu
