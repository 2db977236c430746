#include <hiprt_build/gpu/build.h>

#include <hiprt_build/exec/gpu_sort.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/src/gpu_kernels.h>
#include <hiprt_build/src/gpu_places.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;
using build::Builder;
using build::CollapsePlan;
using build::KeptCluster;
using build::LeafPrimitives;
using build::LeafReference;
using build::LinkedNode;
using build::SortBuffers;
using build::WideWriter;

/// Needed until the tree stands: lies where the wide nodes and the leaves will be, if that is enough.
struct Transient {
  LeafReference* references;
  SortBuffers sort;
  void* sort_temp;
  SortedLeaves sorted;
  KeptCluster* kept;

  Transient(Pieces& pieces, std::uint32_t n, std::size_t sort_temp_bytes) {
    references = pieces.take<LeafReference>(n);
    for (unsigned i = 0; i < 2; ++i) {
      sort.keys[i] = pieces.take<std::uint64_t>(n);
      sort.values[i] = pieces.take<std::uint32_t>(n);
    }
    sort_temp = pieces.take<std::byte>(sort_temp_bytes);
    sorted.references = pieces.take<LeafReference>(n);
    sorted.primitives = nullptr;
    sorted.levels = pieces.take<std::uint8_t>(n);
    sorted.met = pieces.take<std::uint32_t>(n);
    kept = pieces.take<KeptCluster>(n);
  }
};

/// Needed until the wide tree stands.
struct Kept {
  BuildState* state;
  build::GeometryView* geometries;
  LeafPrimitives* primitives;
  LinkedNode* nodes;
  CollapsePlan* plans;

  Kept(Pieces& pieces, std::uint32_t n, std::size_t geometry_count) {
    state = pieces.take<BuildState>(1);
    geometries = pieces.take<build::GeometryView>(geometry_count);
    primitives = pieces.take<LeafPrimitives>(n);
    nodes = pieces.take<LinkedNode>(n);
    plans = pieces.take<CollapsePlan>(n);
  }
};

/// @return the number of all primitives.
Result<std::uint32_t> check_geometries(std::span<const DeviceGeometry> geometries) {
  if (geometries.size() > kMaxGeometries)
    return fail(ErrorCode::kTooLarge, geometries.size(), " geometries, a file names at most ", kMaxGeometries);
  std::uint64_t primitives = 0;
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    const DeviceGeometry& geometry = geometries[i];
    primitives += geometry.primitive_count;
    const bool mesh = geometry.positions != nullptr && geometry.triangles != nullptr && geometry.boxes == nullptr;
    const bool custom = geometry.boxes != nullptr && geometry.positions == nullptr && geometry.triangles == nullptr;
    if (geometry.primitive_count != 0 && !mesh && !custom)
      return fail(ErrorCode::kInvalidInput, "geometry ", i, ": ", geometry.primitive_count,
                  " primitives need positions and triangles, or boxes alone");
  }
  if (primitives > kMaxBuildPrimitives)
    return fail(ErrorCode::kTooLarge, primitives, " primitives, the limit is ", kMaxBuildPrimitives);
  return static_cast<std::uint32_t>(primitives);
}

/// All the sizes and places of a build.
struct Layouts {
  std::uint32_t primitives;
  std::size_t geometries;
  FilePlaces file;
  std::size_t sort_temp_bytes = 0;
  std::uint64_t report, transient, kept;
  bool transient_in_output;

  Layouts(std::uint32_t n, std::size_t geometry_count, NodeLayout layout, std::size_t sort_bytes)
      : primitives(n), geometries(geometry_count), file(layout, n, n, n, geometry_count), sort_temp_bytes(sort_bytes) {
    report = align(file.size, kDeviceAlignment);
    Pieces pieces, more;
    Transient(pieces, n, sort_temp_bytes);
    Kept(more, n, geometry_count);
    transient = pieces.size();
    kept = more.size();
    transient_in_output = transient_offset() + transient <= file.sections[2].offset;
  }
  std::uint64_t transient_offset() const { return align(file.sections[0].offset, kDeviceAlignment); }
  BuildSizes sizes() const {
    return {report + align(sizeof(BuildReport), kDeviceAlignment), kept + (transient_in_output ? 0 : transient)};
  }
};

Result<Layouts> plan_build(std::span<const DeviceGeometry> geometries, const BuildOptions& options) {
  if (auto checked = check_options(options); !checked) return tl::unexpected(std::move(checked.error()));
  const auto primitives = check_geometries(geometries);
  if (!primitives) return tl::unexpected(primitives.error());
  std::size_t sort_temp_bytes = 0;
  SortBuffers none{};
  if (auto asked = build::sort_pairs(nullptr, sort_temp_bytes, none, *primitives, nullptr); !asked)
    return tl::unexpected(std::move(asked.error()));
  const Layouts layouts(*primitives, geometries.size(), options.nodes, sort_temp_bytes);
  if (layouts.file.sections[2].offset > kAddressLimit)
    return fail(ErrorCode::kTooLarge, *primitives, " primitives: their nodes and leaves may end at byte ",
                layouts.file.sections[2].offset, ", a node reference addresses ", kAddressLimit);
  return layouts;
}

/// One build on its way into a stream. Each step gives the error of the one before it.
class Enqueuer {
 public:
  Enqueuer(const Layouts& layouts, const BuildOptions& options, std::byte* output, std::byte* scratch,
           hipStream_t stream)
      : layouts_(layouts),
        options_(options),
        output_(output),
        stream_(stream),
        transient_pieces_(layouts.transient_in_output ? output + layouts.transient_offset() : scratch + layouts.kept),
        kept_pieces_(scratch),
        transient_(transient_pieces_, layouts.primitives, layouts.sort_temp_bytes),
        kept_(kept_pieces_, layouts.primitives, layouts.geometries) {
    transient_.sorted.primitives = kept_.primitives;
    soup_ = {kept_.geometries, static_cast<std::uint32_t>(layouts.geometries), layouts.primitives};
  }

  Result<void> run(std::span<const DeviceGeometry> geometries) {
    one("start", start, kept_.state);
    put(geometries);
    if (layouts_.primitives != 0) {
      pair();
      sort();
      climb();
      dispatch_layout(options_.nodes, [&](auto layout) { write<decltype(layout)>(); });
    }
    const OutputPlan plan = output_plan();
    one("finish", finish, plan, kept_.plans, kept_.state);
    if (layouts_.primitives != 0)
      dispatch_layout(options_.nodes, [&](auto layout) { encode<decltype(layout)>(plan.report); });
    return result_;
  }

 private:
  std::uint32_t n() const { return layouts_.primitives; }
  template <class T> T* section(unsigned i) const {
    return reinterpret_cast<T*>(output_ + layouts_.file.sections[i].offset);
  }

  template <class... Parameters>
  void one(const char* name, void (*kernel)(Parameters...), std::type_identity_t<Parameters>... arguments) {
    if (result_) result_ = launch(kernel, Grid{}, stream_, {.block = 1, .name = name}, arguments...);
  }
  /// A thread per primitive.
  template <class... Parameters>
  void each(const char* name, void (*kernel)(Parameters...), std::type_identity_t<Parameters>... arguments) {
    if (result_) result_ = launch(kernel, std::uint64_t{n()}, stream_, {.block = kBlock, .name = name}, arguments...);
  }
  /// Blocks that the device holds at once, or fewer that have enough to do.
  template <class... Parameters>
  void persistent(const char* name, unsigned block, std::uint64_t most_blocks, void (*kernel)(Parameters...),
                  std::type_identity_t<Parameters>... arguments) {
    if (!result_) return;
    const auto blocks = persistent_grid(kernel, block);
    if (!blocks) {
      result_ = tl::unexpected(blocks.error());
      return;
    }
    const Grid grid{static_cast<unsigned>(std::min<std::uint64_t>(*blocks, most_blocks))};
    result_ = launch(kernel, grid, stream_, {.block = block, .name = name}, arguments...);
  }

  /// By kernel arguments: no memory of the host's has to live on.
  void put(std::span<const DeviceGeometry> geometries) {
    std::uint32_t first = 0;
    for (std::size_t begin = 0; begin < geometries.size() && result_; begin += GeometryChunk::kSize) {
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
      result_ = launch(put_geometries, Grid{}, stream_, {.block = GeometryChunk::kSize, .name = "put_geometries"},
                       chunk, static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(count), kept_.geometries,
                       section<GeometryRecord>(3));
    }
  }

  void pair() {
    if (result_)
      result_ = check(hipMemsetAsync(section<std::byte>(2), 0xff, std::size_t{n()} * sizeof(std::uint32_t), stream_),
                      "hipMemsetAsync", "the primitive map");
    const std::uint64_t windows = (n() - 1) / build::kPairWindow + 1;
    persistent("pair_primitives", kGroupBlock, (windows - 1) / kGroupsPerBlock + 1, pair_primitives,
               {soup_, options_.pair_triangles && options_.max_leaf_triangles > 1}, transient_.references,
               section<GeometryRecord>(3), kept_.state);
  }

  void sort() {
    SortBuffers& buffers = transient_.sort;
    const unsigned bits = options_.builder == Builder::kLbvh30 ? build::kMortonBits30 : build::kMortonBits63;
    each("make_keys", make_keys, transient_.references, n(), bits, kept_.state, buffers.keys[0], buffers.values[0]);
    std::size_t bytes = layouts_.sort_temp_bytes;
    if (result_) result_ = build::sort_pairs(transient_.sort_temp, bytes, buffers, n(), stream_);
    each("gather_leaves", gather_leaves, transient_.references, buffers.keys[buffers.current],
         buffers.values[buffers.current], kept_.state, transient_.sorted);
  }

  void climb() {
    const build::SahCosts& costs = options_.costs;
    const PlannedTree tree{{transient_.sorted.references},
                           kept_.nodes,
                           {kept_.plans,
                            transient_.sorted.references,
                            {costs.box_node, costs.leaf, costs.custom, options_.max_leaf_triangles}},
                           &kept_.state->root};
    if (options_.builder != Builder::kHploc) {
      each("climb_lbvh", climb_lbvh, tree, transient_.sorted, kept_.state);
      return;
    }
    if (result_)
      result_ = launch(climb_hploc, std::uint64_t{n()}, stream_, {.block = kGroupBlock, .name = "climb_hploc"}, tree,
                       transient_.sorted, transient_.kept, kept_.state);
    each("check_depth", check_depth, kept_.plans, transient_.sorted, kept_.state);
    each("lbvh_again", lbvh_again, tree, transient_.sorted, kept_.state);
  }

  template <class Layout> void write() {
    const WideWriter<Layout> writer{soup_,
                                    kept_.nodes,
                                    kept_.plans,
                                    kept_.primitives,
                                    section<typename Layout::Node>(0),
                                    section<typename Layout::Leaf>(1),
                                    section<std::uint32_t>(2),
                                    layouts_.file.sections[0].offset,
                                    layouts_.file.sections[1].offset};
    const build::WideQueue queue{kept_.plans};
    each("begin_wide_tree", begin_wide_tree<Layout>, writer, queue, kept_.state);
    // A team of four lanes for each node at most.
    persistent("write_wide_tree", kBlock, (std::uint64_t{n()} * 4 - 1) / kBlock + 1, write_wide_tree<Layout>, writer,
               queue, kept_.state);
  }

  /// The linked tree is not needed any more.
  template <class Layout> void encode(BuildReport* report) {
    if constexpr (!WideWriter<Layout>::kBoxesApart) {
      build::RefitFile<Layout> file{};
      file.header = reinterpret_cast<FileHeader*>(output_);
      file.nodes = section<typename Layout::Node>(0);
      file.leaves = section<typename Layout::Leaf>(1);
      file.first_node = layouts_.file.sections[0].offset;
      file.first_leaf = layouts_.file.sections[1].offset;
      file.ways = reinterpret_cast<std::uint32_t*>(kept_.nodes);
      each("link_up", link_up<Layout>, file, report);
      each("encode_nodes", encode_nodes<Layout>, file, report);
      one("widen_bounds", widen_bounds<Layout>, file, report);
    }
  }

  OutputPlan output_plan() const {
    OutputPlan plan{};
    plan.base = output_;
    std::copy_n(layouts_.file.sections, 5, plan.sections);
    plan.size = layouts_.file.size;
    plan.report = reinterpret_cast<BuildReport*>(output_ + layouts_.report);
    plan.layout = options_.nodes;
    plan.builder = options_.builder;
    plan.geometries = static_cast<std::uint32_t>(layouts_.geometries);
    plan.primitives = n();
    return plan;
  }

  const Layouts& layouts_;
  const BuildOptions& options_;
  std::byte* output_;
  hipStream_t stream_;
  Pieces transient_pieces_, kept_pieces_;
  Transient transient_;
  Kept kept_;
  build::SoupView soup_{};
  Result<void> result_{};
};

}  // namespace

Result<void> check_options(const BuildOptions& options) {
  if (options.builder != Builder::kLbvh && options.builder != Builder::kLbvh30 && options.builder != Builder::kHploc)
    return fail(ErrorCode::kInvalidInput, "builder ", build::name(options.builder),
                " does not run on the GPU; lbvh, lbvh30 and hploc do");
  if (options.nodes < NodeLayout::kFloat || options.nodes > NodeLayout::kQuantized)
    return fail(ErrorCode::kInvalidInput, "node layout ", static_cast<std::uint32_t>(options.nodes),
                " cannot be written; known are float, planes, half and quantized");
  if (options.max_leaf_triangles < 1 || options.max_leaf_triangles > 64)
    return fail(ErrorCode::kInvalidInput, "max_leaf_triangles is ", options.max_leaf_triangles,
                ", allowed are 1 to 64");
  const build::SahCosts& costs = options.costs;
  if (!(costs.box_node > 0.0f) || !(costs.leaf > 0.0f) || !(costs.custom > 0.0f))
    return fail(ErrorCode::kInvalidInput, "SAH costs must be positive");
  return {};
}

Result<BuildSizes> build_sizes(std::span<const DeviceGeometry> geometries, const BuildOptions& options) {
  const auto layouts = plan_build(geometries, options);
  if (!layouts) return tl::unexpected(layouts.error());
  return layouts->sizes();
}

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
