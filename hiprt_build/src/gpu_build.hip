#include <hiprt_build/gpu/build.h>

#include <hiprt_build/exec/gpu_sort.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/src/gpu_file.h>
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

/// A report with the head of its file.
struct Downloaded {
  BuildReport report;
  std::array<std::byte, kHeaderBytes> head;

  FileHeader& header() { return *reinterpret_cast<FileHeader*>(head.data()); }
  SectionEntry* sections() { return reinterpret_cast<SectionEntry*>(head.data() + sizeof(FileHeader)); }
};

Result<void> wait(hipStream_t stream) { return check(hipStreamSynchronize(stream), "hipStreamSynchronize"); }

Result<void> copy(void* to, const void* from, std::size_t bytes, hipMemcpyKind kind, hipStream_t stream) {
  if (bytes == 0) return {};
  return check(hipMemcpyAsync(to, from, bytes, kind, stream), "hipMemcpyAsync", bytes, " bytes");
}

/// The sections of a file with gaps, at their places in one without.
template <class Layout>
Result<void> move_sections(const Downloaded& from, const FilePlaces& places, std::byte* to, hipStream_t stream) {
  using Node = typename Layout::Node;
  const auto* sections = reinterpret_cast<const SectionEntry*>(from.head.data() + sizeof(FileHeader));
  const std::byte* base = from.report.view.base;
  const std::uint64_t back = sections[1].offset - places.sections[1].offset;
  auto done = launch(move_nodes<Node>, std::uint64_t{from.report.nodes}, stream,
                     {.block = kBlock, .name = "move_nodes"}, reinterpret_cast<const Node*>(base + sections[0].offset),
                     reinterpret_cast<Node*>(to + places.sections[0].offset), from.report.nodes, sections[1].offset,
                     static_cast<std::uint32_t>(back / kNodeGranularity));
  // Zero bytes between the sections.
  std::uint64_t end = kHeaderBytes;
  for (unsigned i = 0; i < 5 && done; ++i) {
    const SectionEntry& section = places.sections[i];
    const std::uint64_t gap = std::min(section.offset, places.size) - std::min(end, places.size);
    if (gap != 0) done = check(hipMemsetAsync(to + end, 0, gap, stream), "hipMemsetAsync", gap, " bytes");
    end = section.offset + section.count * section.stride;
  }
  for (unsigned i = 1; i < 4 && done; ++i)
    done = copy(to + places.sections[i].offset, base + sections[i].offset,
                places.sections[i].count * places.sections[i].stride, hipMemcpyDeviceToDevice, stream);
  return done;
}

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

Result<BuiltScene> compact(const BuildReport* report, hipStream_t stream, Allocator& allocator) {
  Downloaded from;
  auto done = copy(&from.report, report, sizeof(from.report), hipMemcpyDeviceToHost, stream);
  if (done) done = wait(stream);
  if (done && from.report.status == BuildStatus::kTooDeep)
    done = fail(ErrorCode::kTooLarge, "the tree needs ", from.report.view.stack_bound, " stack entries, the limit is ",
                kMaxStackBound);
  if (done && from.report.status == BuildStatus::kTooLarge)
    done = fail(
        ErrorCode::kInvalidInput,
        "a coordinate of 2^126 (8.5e37) or more, which node layout quantized cannot hold; float, planes and half can");
  if (done) done = copy(from.head.data(), from.report.view.base, kHeaderBytes, hipMemcpyDeviceToHost, stream);
  if (done) done = wait(stream);
  if (!done) return tl::unexpected(std::move(done.error()));
  const SceneView& view = from.report.view;
  const FilePlaces places(view.layout, from.report.nodes, from.report.leaves, from.header().primitive_count,
                          from.header().geometry_count);
  auto buffer = DeviceBuffer::make(places.size, stream, allocator);
  if (!buffer) return tl::unexpected(std::move(buffer.error()));
  std::byte* to = buffer->data();
  done = dispatch_layout(view.layout,
                         [&](auto layout) { return move_sections<decltype(layout)>(from, places, to, stream); });
  FileHeader& header = from.header();
  if (header.root != kInvalidRef && ref_offset(header.root) >= from.sections()[1].offset)
    header.root = make_ref(places.sections[1].offset, ref_type(header.root));
  header.byte_size = places.size;
  std::copy_n(places.sections, 5, from.sections());
  if (done) done = copy(to, from.head.data(), kHeaderBytes, hipMemcpyHostToDevice, stream);
  if (done) done = wait(stream);
  if (!done) return tl::unexpected(std::move(done.error()));
  BuiltScene scene{std::move(*buffer), view, from.report};
  scene.view.base = to;
  scene.view.size = places.size;
  scene.view.geometries = reinterpret_cast<const GeometryRecord*>(to + places.sections[3].offset);
  scene.view.root = header.root;
  scene.report.view = scene.view;
  return scene;
}

Result<BuiltScene> build_scene(std::span<const DeviceGeometry> geometries, const BuildOptions& options,
                               hipStream_t stream, Allocator& allocator) {
  const auto sizes = build_sizes(geometries, options);
  if (!sizes) return tl::unexpected(sizes.error());
  auto output = DeviceBuffer::make(sizes->output, stream, allocator);
  if (!output) return tl::unexpected(std::move(output.error()));
  auto scratch = DeviceBuffer::make(sizes->scratch, stream, allocator);
  if (!scratch) return tl::unexpected(std::move(scratch.error()));
  const auto report = enqueue_build(geometries, options, output->data(), scratch->data(), stream);
  if (!report) return tl::unexpected(report.error());
  auto scene = compact(*report, stream, allocator);
  if (scene && scene->report.status == BuildStatus::kBadIndex)
    return fail(ErrorCode::kInvalidInput, scene->report.bad_indices,
                " triangles have an index beyond their mesh's positions");
  return scene;
}

Result<build::Buffer> download_file(const BuiltScene& scene, std::string_view tool, hipStream_t stream) {
  try {
    std::vector<std::byte> bytes(scene.buffer.size());
    if (auto copied = scene.buffer.download(bytes, stream); !copied) return tl::unexpected(std::move(copied.error()));
    if (auto passed = wait(stream); !passed) return tl::unexpected(std::move(passed.error()));
    return build::complete_file(bytes, scene.report, tool);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, scene.buffer.size(), " bytes of host memory wanted for a download");
  }
}

}  // namespace hiprt::gpu
