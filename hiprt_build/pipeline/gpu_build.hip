#include <hiprt_build/pipeline/gpu_build_job.h>

#include <hiprt_build/encode/gpu_encode_kernels.h>
#include <hiprt_build/exchange/gpu_import_kernels.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/input/builder_defaults.h>
#include <hiprt_build/lbvh_ploc/gpu_climb_kernels.h>
#include <hiprt_build/lbvh_ploc/gpu_ploc.h>
#include <hiprt_build/pair/given_pairs.h>
#include <hiprt_build/pair/gpu_pair_kernels.h>
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

/// The launches of a build into a stream.
class Enqueuer {
 public:
  Enqueuer(const BuildJob& job, hipStream_t stream)
      : plan_(job.plan),
        options_(job.options),
        job_(job),
        tree_memory_(job.memory.tree),
        scratch_(job.memory.scratch),
        state_(job.memory.head.state),
        output_(job.output),
        steps_(stream),
        geometries_{job.memory.head.geometries, static_cast<std::uint32_t>(plan_.geometries), plan_.primitives} {}

  Result<void> enqueue_leaves() {
    ask("pair", 0.0);
    steps_.one("start", start, state_);
    put();
    if (plan_.primitives == 0) return steps_.result();
    pair();
    if (plan_.measures_demand)
      steps_.then([&] {
        return enqueue_measure_demand(geometries_, job_.memory.references, plan_.primitives, state_, steps_.stream());
      });
    return steps_.result();
  }

  Result<void> enqueue_split() {
    if (plan_.primitives == 0) return {};
    if (plan_.splits()) steps_.one("note_whole", note_whole, state_);
    if (plan_.presplits()) presplit();
    if (plan_.from_top()) split();
    return steps_.result();
  }

  Result<void> enqueue_tree() {
    if (plan_.primitives == 0) return {};
    if (plan_.imports())
      adopt(job_.geometries[0]);
    else
      plan_.from_top() ? adopt_split() : join();
    steps_.one("count_nodes", count_nodes, tree_memory_.plans, state_);
    return steps_.result();
  }

  Result<void> enqueue_file() {
    if (plan_.primitives != 0) {
      ask("collapse", 0.8);
      steps_.fill_bytes("the primitive map", section<std::uint32_t>(kPrimitiveMapAt), plan_.primitives, 0xff);
      dispatch_layout(plan_.layout, [&](auto layout) { write<decltype(layout)>(); });
    }
    ask("encode", 0.9);
    steps_.one("finish", finish, output_plan(), state_);
    if (plan_.primitives != 0)
      dispatch_layout(plan_.layout, [&](auto layout) {
        encode<decltype(layout)>(output_.report);
        widen<decltype(layout)>(output_.report);
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

  template <class Layout> NodeArray<typename Layout::Node> nodes() const {
    return {section<std::byte>(kNodesAt), NodePlaces(output_.file[kNodesAt], Layout::kId)};
  }
  template <class T> T* section(TreeSection i) const {
    return reinterpret_cast<T*>(output_.base + output_.file[i].offset);
  }

  /// By kernel arguments: no memory of the host's has to live on.
  void put() {
    const std::span<const DeviceGeometry> geometries = job_.geometries;
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
                    static_cast<std::uint32_t>(count), job_.memory.head.geometries, output_.records);
    }
  }

  void pair() {
    const EdgeTableScratch& pairing = job_.memory.pairing;
    const std::uint64_t windows = (plan_.primitives - 1) / build::kPairWindow + 1;
    steps_.persistent("pair_primitives", kGroupBlock, (windows - 1) / kGroupsPerBlock + 1, pair_primitives,
                      {geometries_, plan_.pairs}, job_.memory.references, pairing.singles, output_.records, state_);
    if (!plan_.pairs) return;
    pair_as_given();
    if (plan_.imports()) return;
    steps_.then(
        [&] { return enqueue_pair_by_edges(geometries_, job_.memory.references, pairing, state_, steps_.stream()); });
  }

  /// The claims of triangles lie where the table of edges will be.
  void pair_as_given() {
    const std::span<const DeviceGeometry> geometries = job_.geometries;
    const auto claims = reinterpret_cast<std::uint32_t*>(job_.memory.pairing.table);
    std::uint32_t first = 0;
    for (std::size_t g = 0; g < geometries.size(); first += geometries[g++].primitive_count) {
      const DeviceGeometry& geometry = geometries[g];
      if (geometry.pairs == nullptr || geometry.pair_count == 0 || geometry.primitive_count == 0) continue;
      const build::GivenPairs pairs{view_of(geometry), first, geometry.pairs, geometry.pair_count, claims};
      steps_.fill_bytes("claims", claims, geometry.primitive_count, 0xff);
      steps_.each(geometry.pair_count, "claim_pairs", claim_pairs, pairs);
      steps_.each(geometry.pair_count, "join_pairs", join_pairs, pairs, job_.memory.references, state_);
    }
  }

  void presplit() {
    ask("cut", 0.1);
    steps_.then([&] {
      return enqueue_presplit(
          {geometries_, job_.memory.references, plan_.primitives, plan_.pieces, plan_.presplit_budget, state_},
          scratch_.parts, scratch_.stage, steps_.stream());
    });
  }

  /// That the tree is to be built of.
  const Reference* references() const { return plan_.presplits() ? scratch_.parts : job_.memory.references; }

  build::PlannedTree planned_tree() const {
    const build::SahCosts& costs = options_.costs;
    return {{scratch_.sorted.references},
            tree_memory_.nodes,
            {tree_memory_.plans,
             scratch_.sorted.references,
             {costs.box_node, costs.leaf, costs.custom, options_.max_leaf_triangles}},
            &state_->root};
  }

  /// The tree from the root down.
  void split() {
    ask("split", 0.2);
    const bool gapped = plan_.gapped();
    Reference* const leaves = gapped ? job_.memory.gapped.leaves : scratch_.sorted.references;
    build::LinkedNode* const nodes = gapped ? job_.memory.gapped.nodes : tree_memory_.nodes;
    steps_.then([&] {
      return enqueue_top_down({geometries_, references(), plan_.references(), plan_.slots, plan_.split_budget,
                               plan_.split_budget > 1.0, build::defaults_of(plan_.builder).splits},
                              {leaves, nodes, &state_->root, &state_->counts.leaves}, scratch_.stage, steps_.stream(),
                              plan_.tuning(), LongStep(options_.progress, "split", 0.2, 0.5, plan_.unasked));
    });
  }

  void adopt_split() {
    if (plan_.gapped())
      steps_.then([&] {
        return enqueue_compact_tree(job_.memory.gapped, plan_.slots,
                                    {scratch_.sorted.references, tree_memory_.nodes, plan_.capacity, &state_->root},
                                    scratch_.stage, steps_.stream());
      });
    steps_.each(plan_.capacity, "list_primitives", list_primitives, scratch_.sorted.references, plan_.capacity,
                tree_memory_.primitives);
    finish_tree();
  }

  /// The caller's tree.
  void adopt(const DeviceGeometry& geometry) {
    ask("import", 0.2);
    const std::uint32_t leaves = plan_.imported_leaves;
    Arena arena(scratch_.stage);
    build::GpuImport job{};
    build::GpuImport::take(arena, plan_.primitives, leaves, job);
    job.tree = job_.imported;
    job.pairs = plan_.pairs ? geometry.pairs : nullptr;
    job.pair_count = geometry.pair_count;
    job.primitives = plan_.primitives;
    job.references = job_.memory.references;
    job.leaves = scratch_.sorted.references;
    job.nodes = tree_memory_.nodes;
    steps_.one("start_import", start_import, state_);
    steps_.fill_bytes("uses", job.uses, plan_.primitives, 0);
    steps_.fill_bytes("parents", job.parents, 2 * std::uint64_t{leaves}, 0xff);
    steps_.fill_bytes("arrivals", job.met, leaves, 0);
    steps_.fill_bytes("leaves below", job.below, leaves, 0);
    steps_.fill_bytes("nodes", job.nodes, plan_.capacity, 0xff);
    steps_.each(leaves, "count_uses", count_uses, job, state_);
    steps_.each(leaves, "link_children", link_children, job, state_);
    steps_.each(leaves, "make_leaves", make_leaves, job, state_);
    steps_.each(leaves, "splice", splice, job, state_);
    steps_.each(plan_.capacity, "drop_bad_tree", drop_bad_tree, job, state_);
    steps_.one("end_import", end_import, state_);
    steps_.each(plan_.primitives, "count_missing", count_missing, job, geometries_, output_.records, state_);
    steps_.each(plan_.capacity, "list_primitives", list_primitives, scratch_.sorted.references, plan_.capacity,
                tree_memory_.primitives);
    finish_tree();
  }

  /// The tree from the leaves up.
  void join() {
    const std::uint32_t n = plan_.pieces;
    ask("sort", 0.2);
    sort();
    ask("tree", 0.3);
    if (plan_.finishes()) steps_.fill_bytes("nodes", tree_memory_.nodes, n, 0xff);
    if (plan_.builder == Builder::kPloc) {
      steps_.then([&] {
        return enqueue_ploc({scratch_.sorted.references, &state_->counts.leaves, n, plan_.radius},
                            {tree_memory_.nodes, &state_->root}, scratch_.stage, steps_.stream());
      });
    } else if (plan_.builder == Builder::kHploc) {
      steps_.then([&] {
        return launch(climb_hploc, std::uint64_t{n}, steps_.stream(), {.block = kGroupBlock, .name = "climb_hploc"},
                      planned_tree(), scratch_.sorted, scratch_.kept, plan_.radius, state_);
      });
    } else {
      steps_.each(n, "climb_lbvh", climb_lbvh, planned_tree(), scratch_.sorted, state_);
    }
    if (plan_.finishes()) finish_tree();
    if (plan_.builder == Builder::kLbvh || plan_.builder == Builder::kLbvh30) return;
    const std::uint64_t blocks = (std::uint64_t{n} - 1) / kBlock + 1;
    steps_.persistent("check_depth", kBlock, blocks, check_depth, tree_memory_.plans, scratch_.sorted, state_);
    steps_.persistent("lbvh_again", kBlock, blocks, lbvh_again, planned_tree(), scratch_.sorted, state_);
  }

  void sort() {
    const std::uint32_t n = plan_.references();
    SortBuffers buffers = tree_memory_.sort;
    const unsigned bits = plan_.builder == Builder::kLbvh30 ? build::kMortonBits30 : build::kMortonBits63;
    if (plan_.presplits()) {
      // Parts have other centres than their triangles.
      steps_.one("clear_centers", clear_centers, state_);
      steps_.persistent("bound_centers", kBlock, (n - 1) / kBlock + 1, bound_centers, references(), n, state_);
    }
    if (plan_.packs()) {
      std::uint64_t* const words = tree_memory_.pack_words;
      const std::uint64_t tiles = (std::uint64_t{n} - 1) / kPackTile + 1;
      steps_.fill_bytes("the tiles", words, pack_words(plan_), 0);
      steps_.blocks("pack_keys", kBlock, tiles, pack_keys, references(), n, bits, state_,
                    build::TileSums(reinterpret_cast<std::uint32_t*>(words), words + 1, 1), buffers.keys[0],
                    buffers.values[0]);
    } else {
      steps_.each(n, "make_keys", make_keys, references(), n, bits, state_, buffers.keys[0], buffers.values[0]);
    }
    std::size_t bytes = plan_.sort_bytes;
    steps_.then(
        [&] { return build::sort_pairs(tree_memory_.sort_temp, bytes, buffers, plan_.keys(), steps_.stream()); });
    steps_.each(plan_.pieces, "gather_leaves", gather_leaves, references(), buffers.keys[buffers.current],
                buffers.values[buffers.current], state_, scratch_.sorted);
  }

  void finish_tree() {
    ask("reinsert", 0.5);
    steps_.then([&] {
      const bool has_gaps = plan_.imports() || (plan_.leaves_gaps() && !plan_.gapped());
      const std::uint32_t* const leaves = has_gaps ? nullptr : &state_->counts.leaves;
      const bool limits = plan_.usual_rounds && plan_.splits() && leaves != nullptr;
      return enqueue_finish_tree(
          {planned_tree(), plan_.capacity, leaves, plan_.rounds, limits ? &state_->whole : nullptr}, scratch_.stage,
          steps_.stream(), LongStep(options_.progress, "reinsert", 0.5, 0.8, plan_.unasked));
    });
  }

  template <class Layout> void write() {
    const WideWriter<Layout> writer{geometries_,
                                    tree_memory_.nodes,
                                    tree_memory_.plans,
                                    tree_memory_.primitives,
                                    nodes<Layout>(),
                                    section<typename Layout::Leaf>(kLeavesAt),
                                    section<std::uint32_t>(kPrimitiveMapAt),
                                    output_.file[kNodesAt].offset,
                                    output_.file[kLeavesAt].offset,
                                    tree_memory_.leaves,
                                    tree_memory_.leaf_boxes};
    const build::WideQueue queue{tree_memory_.plans};
    GridProgress* const progress = tree_memory_.progress;
    steps_.each(plan_.wide, "begin_wide_tree", begin_wide_tree<Layout>, writer, queue, state_, progress);
    // A team of four lanes for each node at most.
    steps_.persistent("write_wide_tree", kBlock, (std::uint64_t{plan_.wide} * 4 - 1) / kBlock + 1,
                      write_wide_tree<Layout>, writer, queue, plan_.many_nodes, state_, progress);
  }

  /// Overwrites the linked tree.
  template <class Layout> void encode(BuildReport* report) {
    if constexpr (!WideWriter<Layout>::kBoxesApart) {
      build::RefitFile<Layout> file{};
      file.header = reinterpret_cast<FileHeader*>(output_.base);
      file.nodes = nodes<Layout>();
      file.leaves = section<typename Layout::Leaf>(kLeavesAt);
      file.first_node = output_.file[kNodesAt].offset;
      file.first_leaf = output_.file[kLeavesAt].offset;
      file.parents = reinterpret_cast<std::uint32_t*>(tree_memory_.nodes);
      file.leaf_boxes = tree_memory_.leaf_boxes;
      steps_.each(plan_.wide, "link_up", link_up<Layout>, file, report);
      steps_.each(plan_.wide, "encode_nodes", encode_nodes<Layout>, file, report);
      steps_.one("widen_bounds", widen_bounds<Layout>, file, report);
    }
  }

  template <class Layout> void widen(BuildReport* report) {
    if constexpr (may_be_widened(Layout::kId)) {
      if (!options_.widen_boxes) return;
      auto* header = reinterpret_cast<FileHeader*>(output_.base);
      const auto nodes = this->nodes<Layout>();
      steps_.one("widen_header", widen_header, header, report);
      steps_.each(plan_.wide, "widen_nodes", widen_nodes<Layout>, build::WidenNodeStep<Layout>{nodes, header}, report);
      steps_.one("widen_view", widen_view<Layout>, build::WidenBoundsStep<Layout>{header, nodes}, report);
    }
  }

  OutputPlan output_plan() const {
    OutputPlan plan{};
    plan.base = output_.base;
    std::copy_n(output_.file.begin(), kTreeSections, plan.sections);
    plan.size = output_.file.byte_size();
    plan.report = output_.report;
    plan.layout = plan_.layout;
    plan.builder = plan_.builder;
    plan.geometries = static_cast<std::uint32_t>(plan_.geometries);
    plan.primitives = plan_.primitives;
    return plan;
  }

  const BuildPlan& plan_;
  const BuildOptions& options_;
  const BuildJob& job_;
  const TreeMemory& tree_memory_;
  const TreeScratch& scratch_;
  BuildState* state_;
  const BuildOutput& output_;
  Launcher steps_;
  build::GeometryTable geometries_;
};

}  // namespace

Result<void> enqueue_leaves(const BuildJob& job, hipStream_t stream) { return Enqueuer(job, stream).enqueue_leaves(); }
Result<void> enqueue_split(const BuildJob& job, hipStream_t stream) { return Enqueuer(job, stream).enqueue_split(); }
Result<void> enqueue_tree(const BuildJob& job, hipStream_t stream) { return Enqueuer(job, stream).enqueue_tree(); }
Result<void> enqueue_file(const BuildJob& job, hipStream_t stream) { return Enqueuer(job, stream).enqueue_file(); }

}  // namespace hiprt::gpu
