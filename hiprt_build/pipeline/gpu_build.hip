#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/gpu/build.h>

#include <hiprt_build/encode/gpu_encode_kernels.h>
#include <hiprt_build/exec/gpu_launcher.h>
#include <hiprt_build/lbvh_ploc/gpu_climb_kernels.h>
#include <hiprt_build/lbvh_ploc/gpu_ploc.h>
#include <hiprt_build/pair/gpu_pair_kernels.h>
#include <hiprt_build/pipeline/gpu_build_plan.h>
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
  Enqueuer(const Layouts& layouts, const BuildOptions& options, std::byte* output, std::byte* scratch,
           hipStream_t stream)
      : layouts_(layouts),
        plan_(layouts.plan),
        options_(options),
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
      pair();
      if (plan_.splits()) steps_.one("note_whole", note_whole, kept_.state);
      if (plan_.presplits()) presplit();
      plan_.from_top() ? split() : join();
      ask("collapse", 0.8);
      dispatch_layout(plan_.layout, [&](auto layout) { write<decltype(layout)>(); });
    }
    ask("encode", 0.9);
    const OutputPlan plan = output_plan();
    steps_.one("finish", finish, plan, kept_.plans, kept_.state);
    if (plan_.primitives != 0)
      dispatch_layout(plan_.layout, [&](auto layout) { encode<decltype(layout)>(plan.report); });
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
        const DeviceGeometry& geometry = geometries[begin + i];
        const std::uint32_t flags = geometry.boxes != nullptr ? custom_geometry_flags(geometry.type) : 0u;
        chunk.views[i] = {geometry.positions,
                          geometry.triangles,
                          geometry.boxes,
                          geometry.position_count,
                          geometry.primitive_count,
                          first,
                          geometry.mask,
                          flags};
        first += geometry.primitive_count;
      }
      steps_.blocks("put_geometries", GeometryChunk::kSize, 1, put_geometries, chunk, static_cast<std::uint32_t>(begin),
                    static_cast<std::uint32_t>(count), kept_.geometries, section<GeometryRecord>(kGeometriesAt));
    }
  }

  void pair() {
    const std::uint32_t n = plan_.primitives;
    steps_.fill_bytes("the primitive map", section<std::uint32_t>(kPrimitiveMapAt), n, 0xff);
    const std::uint64_t windows = (n - 1) / build::kPairWindow + 1;
    steps_.persistent("pair_primitives", kGroupBlock, (windows - 1) / kGroupsPerBlock + 1, pair_primitives,
                      {geometries_, plan_.pairs}, transient_.references, transient_.pairing.singles,
                      section<GeometryRecord>(kGeometriesAt), kept_.state);
    if (!plan_.pairs) return;
    steps_.then([&] {
      return enqueue_pair_by_edges(geometries_, transient_.references, transient_.pairing, kept_.state,
                                   steps_.stream());
    });
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

  PlannedTree tree() const {
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
      return enqueue_top_down(
          {geometries_, references_, plan_.pieces, plan_.capacity, plan_.split_budget, plan_.split_budget > 1.0},
          {transient_.sorted.references, kept_.nodes, &state->root, &state->counts.leaves}, transient_.stage,
          steps_.stream(), plan_.tuning());
    });
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
  std::byte* output_;
  Launcher steps_;
  Arena transient_pieces_, kept_pieces_;
  Transient transient_;
  Kept kept_;
  const Reference* references_;  ///< That the tree is to be built of.
  build::GeometryTable geometries_{};
};

}  // namespace

Result<const BuildReport*> enqueue_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                                         std::byte* output, std::byte* scratch, hipStream_t stream) {
  const auto layouts = plan_build(geometries, options);
  if (!layouts) return tl::unexpected(layouts.error());
  for (const std::byte* memory : {output, scratch})
    if (memory == nullptr || reinterpret_cast<std::uintptr_t>(memory) % kDeviceAlignment != 0)
      return fail(ErrorCode::kInvalidInput, "enqueue_build: output and scratch must be aligned to ", kDeviceAlignment,
                  " bytes");
  Enqueuer enqueuer(*layouts, options, output, scratch, stream);
  if (auto started = enqueuer.run(geometries); !started) return tl::unexpected(std::move(started.error()));
  return reinterpret_cast<const BuildReport*>(output + layouts->report);
}

}  // namespace hiprt::gpu
