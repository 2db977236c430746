#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/refit.h>

#include <hiprt_build/encode/widen_boxes.h>
#include <hiprt_build/exec/gpu_arena.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_build/pipeline/gpu_geometry.h>
#include <hiprt_build/refit/gpu_refit_kernels.h>
#include <hiprt_device/format/quantize.h>

#include <algorithm>

namespace hiprt::gpu {
namespace {

using namespace build::kernels;

struct Scratch {
  RefitReport* report;
  build::OuterPlanes* outer;
  std::uint64_t* fault;
  build::GeometryView* geometries;
  std::uint32_t* parents;
  build::QualitySums* parts;

  Scratch(Arena& arena, const SceneParts& scene) {
    report = arena.take<RefitReport>(1);
    outer = arena.take<build::OuterPlanes>(1);
    fault = arena.take<std::uint64_t>(1);
    geometries = arena.take<build::GeometryView>(scene.geometry_count);
    parents = arena.take<std::uint32_t>(scene.nodes);
    parts = arena.take<build::QualitySums>(kQualityBlocks);
  }
};

/// Launches on one scene of a layout. Each gives the error of the one before it.
template <class Layout> class Refitter {
 public:
  Refitter(const SceneParts& scene, std::byte* memory, hipStream_t stream, const build::SahCosts& costs)
      : scene_(scene), arena_(memory), scratch_(arena_, scene), stream_(stream) {
    auto* header = reinterpret_cast<FileHeader*>(scene.base);
    const NodeArray<typename Layout::Node> nodes(scene.base + scene.first_node,
                                                 NodePlaces(sizeof(typename Layout::Node), scene.node_gaps));
    auto* leaves = reinterpret_cast<typename Layout::Leaf*>(scene.base + scene.first_leaf);
    file_ = build::RefitFile<Layout>{
        header,           nodes,         leaves, scene.first_node, scene.first_leaf, scratch_.geometries,
        scratch_.parents, scratch_.outer};
    quality_ = build::TreeQuality<Layout>{header, nodes, leaves, scene.first_node, scene.first_leaf, costs};
    result_ = launch(start_refit, Grid{}, stream, {.block = 1, .name = "start_refit"}, scratch_.report, scratch_.outer,
                     scratch_.fault);
  }

  void refit(std::span<const DeviceGeometry> moved) {
    put(moved);
    const auto nodes = static_cast<std::uint32_t>(scene_.nodes), leaves = static_cast<std::uint32_t>(scene_.leaves);
    const float limit = Layout::kId == NodeLayout::kQuantized ? kQuantizedLimit : build::kNoLimit;
    if (result_)
      result_ = launch(check_leaves<Layout>, scene_.leaves, stream_, {.block = kRefitBlock, .name = "check_leaves"},
                       file_, leaves, limit, scratch_.fault);
    each("link_up", build::LinkUpStep<Layout>{file_}, nodes);
    each("move_leaves", build::MoveLeafStep<Layout>{file_}, leaves);
    each("refit_nodes", build::RefitNodeStep<Layout>{file_}, nodes);
    each("move_bounds", build::MoveBoundsStep<Layout>{file_}, scene_.root != kInvalidRef ? 1 : 0);
    if constexpr (may_be_widened(Layout::kId)) {
      each("widen_header", build::WidenAgainStep{{file_.header, scene_.nodes}}, 1);
      each("widen_nodes", build::WidenNodeStep<Layout>{file_.nodes, file_.header}, nodes);
      each("widen_bounds", build::WidenBoundsStep<Layout>{file_.header, file_.nodes}, nodes != 0 ? 1 : 0);
    }
  }

  Result<const RefitReport*> finish() {
    if (result_)
      result_ =
          launch(measure_nodes<Layout>, Grid{kQualityBlocks}, stream_, {.block = kRefitBlock, .name = "measure_nodes"},
                 quality_, static_cast<std::uint32_t>(scene_.nodes), scratch_.parts);
    if (result_)
      result_ = launch(finish_refit<Layout>, Grid{}, stream_, {.block = 1, .name = "finish_refit"}, quality_,
                       scratch_.parts, scratch_.fault, scene_.geometries, scratch_.report);
    if (!result_) return tl::unexpected(std::move(result_.error()));
    return scratch_.report;
  }

 private:
  template <class Step> void each(const char* name, const Step& step, std::uint32_t count) {
    if (result_)
      result_ = launch(refit_each<Step>, std::uint64_t{count}, stream_, {.block = kRefitBlock, .name = name}, step,
                       count, scratch_.fault);
  }

  /// By kernel arguments: no memory of the host's has to live on.
  void put(std::span<const DeviceGeometry> moved) {
    for (std::size_t begin = 0; begin < moved.size() && result_; begin += MovedChunk::kSize) {
      const std::size_t count = std::min<std::size_t>(MovedChunk::kSize, moved.size() - begin);
      MovedChunk chunk{};
      for (std::size_t i = 0; i < count; ++i) {
        chunk.geometries[i] = view_of(moved[begin + i]);
      }
      result_ = launch(put_moved, Grid{}, stream_, {.block = MovedChunk::kSize, .name = "put_moved"}, chunk,
                       static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(count), scene_.geometries,
                       scratch_.geometries, scratch_.fault);
    }
  }

  const SceneParts& scene_;
  Arena arena_;
  Scratch scratch_;
  hipStream_t stream_;
  build::RefitFile<Layout> file_{};
  build::TreeQuality<Layout> quality_{};
  Result<void> result_{};
};

Result<void> check_scene(const SceneParts& scene, const std::byte* scratch) {
  if (scene.base == nullptr || scratch == nullptr || reinterpret_cast<std::uintptr_t>(scratch) % kDeviceAlignment != 0)
    return fail(ErrorCode::kInvalidInput, "refit: scene and scratch must be there, scratch aligned to ",
                kDeviceAlignment, " bytes");
  if (scene.layout < NodeLayout::kFloat || scene.layout > NodeLayout::kQuantized)
    return fail(ErrorCode::kInvalidInput, "refit: layout ", static_cast<std::uint32_t>(scene.layout),
                " is none of NodeLayout");
  return {};
}

}  // namespace

SceneParts parts_of(BuiltScene& scene) {
  const gpu::BuildReport& report = scene.report;
  const FileLayout file = tree_layout(scene.view.layout, {report.nodes, report.leaves});
  return {.base = scene.buffer.data(),
          .layout = scene.view.layout,
          .root = scene.view.root,
          .first_node = file[kNodesAt].offset,
          .nodes = report.nodes,
          .node_gaps = NodePlaces::has_gaps(scene.view.layout),
          .first_leaf = file[kLeavesAt].offset,
          .leaves = report.leaves,
          .geometries = scene.view.geometries,
          .geometry_count = report.geometries};
}

SceneParts parts_of(DeviceScene& scene, const BufferView& view) {
  std::byte* base = scene.buffer.data() + (scene.view.base - scene.buffer.data());
  return {base,
          view.layout(),
          view.header->root,
          view.nodes.offset,
          view.node_count(),
          view.node_places().has_gaps(),
          view.leaves.offset,
          view.leaves.count,
          scene.view.geometries,
          view.header->geometry_count};
}

std::uint64_t refit_scratch(const SceneParts& scene) {
  Arena arena;
  Scratch(arena, scene);
  return arena.size();
}

Result<const RefitReport*> enqueue_refit(const SceneParts& scene, std::span<const DeviceGeometry> moved,
                                         std::byte* scratch, hipStream_t stream, const build::SahCosts& costs) {
  if (auto checked = check_scene(scene, scratch); !checked) return tl::unexpected(std::move(checked.error()));
  if (moved.size() != scene.geometry_count)
    return fail(ErrorCode::kInvalidInput, "refit: ", moved.size(), " geometries, the scene has ", scene.geometry_count);
  for (std::size_t i = 0; i < moved.size(); ++i)
    if (auto arrays = check_arrays(moved[i], i); !arrays) return tl::unexpected(std::move(arrays.error()));
  return dispatch_layout(scene.layout, [&](auto layout) {
    Refitter<decltype(layout)> refitter(scene, scratch, stream, costs);
    refitter.refit(moved);
    return refitter.finish();
  });
}

Result<const RefitReport*> enqueue_quality(const SceneParts& scene, std::byte* scratch, hipStream_t stream,
                                           const build::SahCosts& costs) {
  if (auto checked = check_scene(scene, scratch); !checked) return tl::unexpected(std::move(checked.error()));
  return dispatch_layout(
      scene.layout, [&](auto layout) { return Refitter<decltype(layout)>(scene, scratch, stream, costs).finish(); });
}

}  // namespace hiprt::gpu
