#include <hiprt_build/encode/widen_boxes.h>
#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/format/checksum.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/input/check_input.h>
#include <hiprt_build/input/provenance.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/refit/refit_file.h>
#include <hiprt_build/statistics/tree_quality.h>

#include <cstring>

namespace hiprt::build {
namespace {

Result<void> check_options(const RefitOptions& options) {
  if (!(options.rebuild_slack >= 0.0))
    return tl::unexpected(
        invalid("rebuild_slack is " + std::to_string(options.rebuild_slack) + ", it must be at least 0"));
  if (!(options.rebuild_ratio >= 1.0))
    return tl::unexpected(
        invalid("rebuild_ratio is " + std::to_string(options.rebuild_ratio) + ", it must be at least 1"));
  return {};
}

/// The moved scene has the file's geometries.
Result<void> check_geometries(const BufferView& view, const BuildInput& input) {
  if (input.geometries.size() != view.geometries.size())
    return tl::unexpected(invalid(std::to_string(input.geometries.size()) + " geometries, but the file to refit has " +
                                  std::to_string(view.geometries.size())));
  for (std::size_t g = 0; g < input.geometries.size(); ++g) {
    const GeometryRecord& record = view.geometries[g];
    const bool custom = g >= input.meshes.size();
    if (custom != ((record.flags & kGeometryCustom) != 0))
      return tl::unexpected(invalid(describe(input, g) + ": geometry " + std::to_string(g) +
                                    " of the file to refit is " + (custom ? "a mesh" : "of custom primitives")));
    if (input.geometries[g].primitive_count != record.primitive_count)
      return tl::unexpected(invalid(describe(input, g) + ": " + std::to_string(input.geometries[g].primitive_count) +
                                    (custom ? " primitives" : " triangles") + ", but the file to refit has " +
                                    std::to_string(record.primitive_count)));
    if (input.geometries[g].flags != record.flags)
      return tl::unexpected(invalid(describe(input, g) + ": type " +
                                    std::to_string(geometry_type(input.geometries[g].flags)) +
                                    ", but in the file to refit type " + std::to_string(geometry_type(record.flags))));
  }
  return {};
}

/// The moved shapes are the file's, with other points: what their primitives are stays.
Result<void> check_same_shapes(const BufferView& view, const BuildInput& input) {
  for (std::size_t g = input.meshes.size(); g < input.geometries.size(); ++g) {
    const Shapes& shapes = input.customs[g - input.meshes.size()].shapes;
    const ShapeKind kind = view.shapes.empty() ? ShapeKind::kNone : view.shapes[g].kind;
    const auto kind_text = [](ShapeKind k) {
      return k == ShapeKind::kSpheres           ? "spheres"
             : k == ShapeKind::kCurves          ? "curves"
             : k == ShapeKind::kMovingTriangles ? "moving triangles"
                                                : "custom primitives without shapes";
    };
    if (shapes.kind != kind)
      return tl::unexpected(invalid(describe(input, g) + ": " + kind_text(shapes.kind) +
                                    ", but in the file to refit they are " + kind_text(kind)));
    if (kind == ShapeKind::kNone) continue;
    if (shapes.points.size() != view.shapes[g].point_count)
      return tl::unexpected(invalid(describe(input, g) + ": " + std::to_string(shapes.points.size()) +
                                    " points of shapes, but the file to refit has " +
                                    std::to_string(view.shapes[g].point_count)));
    if (shapes.keys != view.shapes[g].keys)
      return tl::unexpected(invalid(describe(input, g) + ": " + std::to_string(shapes.keys) +
                                    " keys, but the file to refit has " + std::to_string(view.shapes[g].keys)));
    const auto segments = view.segments_of(g);
    const auto [here, there] =
        std::mismatch(shapes.segments.begin(), shapes.segments.end(), segments.begin(), segments.end());
    if (here != shapes.segments.end() && kind == ShapeKind::kMovingTriangles)
      return tl::unexpected(invalid(describe(input, g) + ": triangle " +
                                    std::to_string((here - shapes.segments.begin()) / 3) + " has vertex " +
                                    std::to_string(*here) + ", but in the file to refit " + std::to_string(*there)));
    if (here != shapes.segments.end())
      return tl::unexpected(invalid(describe(input, g) + ": segment " + std::to_string(here - shapes.segments.begin()) +
                                    " begins at point " + std::to_string(*here) + ", but in the file to refit at " +
                                    std::to_string(*there)));
  }
  return {};
}

const char* reason(MoveFault fault, bool custom) {
  switch (fault) {
    case MoveFault::kNotFinite:
      return custom ? "is in the tree, but its box is not finite now" : "is in the tree, but is not finite now";
    case MoveFault::kInverted:
      return "is in the tree, but its box is inverted now";
    default:
      return "has a coordinate of 2^126 (8.5e37) or more now, which node layout quantized cannot hold";
  }
}

/// Finds the first leaf that cannot hold its moved primitives.
Result<void> check_leaves(CpuEngine& engine, const BufferView& view, const BuildInput& input,
                          std::span<const GeometryView> geometries) {
  const float limit = view.layout() == NodeLayout::kQuantized ? kQuantizedLimit : kNoLimit;
  const std::span<const CustomLeaf> leaves = view.records<CustomLeaf>(view.leaves);
  const std::size_t i = engine.find_first(leaves.size(), [&](std::size_t k) {
    return leaf_fault(geometries.data(), leaves[k].info, limit) != MoveFault::kNone;
  });
  if (i == leaves.size()) return {};
  const LeafInfo& info = leaves[i].info;
  const std::uint32_t g = info.geometry_and_flags & kGeometryMask;
  for (const std::uint32_t primitive : info.primitive)
    if (primitive != kInvalidId)
      if (const MoveFault fault = primitive_fault(geometries[g], primitive, limit); fault != MoveFault::kNone)
        return tl::unexpected(invalid(describe(input, g, primitive) + reason(fault, geometries[g].is_custom())));
  return tl::unexpected(invalid(describe(input, g, info.primitive[0]) + "its edge with triangle " +
                                std::to_string(info.primitive[1]) +
                                ", with which it shares a leaf, has come apart, or its corners are others than at the "
                                "build: that needs a new build (without pairs every motion can be refitted)"));
}

/// Finds the first primitive that is in no leaf, and now would be.
Result<void> check_dropped(CpuEngine& engine, const BufferView& view, const BuildInput& input,
                           std::span<const GeometryView> geometries) {
  for (std::size_t g = 0; g < geometries.size(); ++g) {
    if (view.geometries[g].dropped_count == 0) continue;
    const std::uint32_t* map = view.primitive_map.data() + input.geometries[g].first;
    const std::size_t i = engine.find_first(input.geometries[g].primitive_count, [&](std::size_t k) {
      return map[k] == kInvalidId && would_be_kept(geometries[g], static_cast<std::uint32_t>(k));
    });
    if (i != input.geometries[g].primitive_count)
      return tl::unexpected(
          invalid(describe(input, g, i) + "was dropped by the build, and is good now: that needs a new build"));
  }
  return {};
}

/// A refit of a file in memory.
template <class Layout> class Refit {
 public:
  Refit(CpuEngine& engine, std::span<std::byte> bytes, const BufferView& view, const BuildInput& input)
      : engine_(engine),
        bytes_(bytes),
        view_(view),
        input_(input),
        geometries_(input.geometries),
        parents_(engine.allocate<std::uint32_t>(view.node_count())),
        parts_(CpuEngine::chunk_count(view.node_count())),
        file_{reinterpret_cast<FileHeader*>(bytes.data()),
              NodeArray<typename Layout::Node>(bytes.data() + view.nodes.offset, view.node_places()),
              reinterpret_cast<typename Layout::Leaf*>(bytes.data() + view.leaves.offset),
              view.nodes.offset,
              view.leaves.offset,
              geometries_.data(),
              parents_.data(),
              &outer_} {}

  /// @param writing set once nothing can go wrong and the first byte is about to be written.
  Result<RefitStatistics> run(const RefitOptions& options, bool& writing) {
    Stopwatch total, watch;
    RefitStatistics statistics{.nodes = view_.node_count(), .leaves = view_.leaves.count};
    engine_.monitor().start("check", 0.35, input_.primitive_count() + view_.leaves.count);
    if (auto checked = check(); !checked) return tl::unexpected(checked.error());
    BuiltTree built = read_built_tree(view_.provenance);
    if (!built.sah_cost || !built.exchange_slack) complete(built);
    statistics.check_seconds = watch.lap();
    engine_.monitor().start("refit", 0.95, view_.leaves.count + 3 * view_.node_count());
    writing = true;
    write();
    statistics.write_seconds = watch.lap();
    advise(statistics, built, options);
    statistics.measure_seconds = watch.lap();
    engine_.monitor().start("checksum", 1.0, 1);
    file_.header->checksum = file_checksum(bytes_);
    statistics.scratch_bytes_peak = engine_.ledger().peak();
    statistics.total_seconds = total.lap();
    return statistics;
  }

 private:
  Result<void> check() {
    if (auto indices = check_indices(engine_, input_); !indices) return indices;
    if (auto shapes = check_shapes(engine_, input_); !shapes) return shapes;
    if (auto same = check_same_shapes(view_, input_); !same) return same;
    if (auto leaves = check_leaves(engine_, view_, input_, geometries_); !leaves) return leaves;
    return check_dropped(engine_, view_, input_, geometries_);
  }

  void write() {
    engine_.for_each(view_.node_count(), LinkUpStep<Layout>{file_});
    engine_.for_each(view_.leaves.count, MoveLeafStep<Layout>{file_});
    engine_.for_each(view_.node_count(), RefitNodeStep<Layout>{file_});
    if (file_.header->root != kInvalidRef) MoveBoundsStep<Layout>{file_}(0);
    if ((file_.header->features & feature_bit(Feature::kWidenedBoxes)) != 0)
      widen_file(engine_, bytes_.data(), view_.nodes.offset, view_.node_count());
    for (std::size_t c = 0; c < input_.customs.size(); ++c) {
      const std::span<const ShapePoint> points = input_.customs[c].shapes.points;
      if (points.empty()) continue;
      const ShapeRecord& record = view_.shapes[input_.meshes.size() + c];
      engine_.copy(points, std::span(reinterpret_cast<ShapePoint*>(bytes_.data() + record.points), points.size()));
    }
  }

  TreeQuality<Layout> quality(const SahCosts& costs) const {
    return {file_.header, file_.nodes, file_.leaves, file_.first_node, file_.first_leaf, costs};
  }

  /// What the provenance does not say: of the tree as it is.
  void complete(BuiltTree& built) {
    const TreeQuality<Layout> now = quality(built.costs);
    const QualitySums sums = sum_quality(engine_, now, view_.node_count(), parts_);
    if (!built.sah_cost) built.sah_cost = now.sah_cost(sums);
    if (!built.exchange_slack) built.exchange_slack = sums.exchange_slack();
  }

  void advise(RefitStatistics& statistics, const BuiltTree& built, const RefitOptions& options) {
    const TreeQuality<Layout> now = quality(built.costs);
    const QualitySums sums = sum_quality(engine_, now, view_.node_count(), parts_);
    statistics.sah_cost_built = *built.sah_cost;
    statistics.sah_cost = now.sah_cost(sums);
    statistics.exchange_slack_built = *built.exchange_slack;
    statistics.exchange_slack = sums.exchange_slack();
    // Without area the cost is a count, which a build does not change.
    if (exact_half_area(file_.header->bounds) > 0 && statistics.sah_cost_built > 0)
      statistics.cost_ratio = statistics.sah_cost / statistics.sah_cost_built;
    const bool split = (file_.header->features & feature_bit(Feature::kSplitReferences)) != 0;
    statistics.rebuild_advised = statistics.exchange_slack > statistics.exchange_slack_built + options.rebuild_slack ||
                                 (split && statistics.cost_ratio > options.rebuild_ratio);
  }

  CpuEngine& engine_;
  std::span<std::byte> bytes_;
  const BufferView& view_;
  const BuildInput& input_;
  std::span<const GeometryView> geometries_;
  ScratchArray<std::uint32_t> parents_;
  std::vector<QualitySums> parts_;  ///< Allocated before the first byte is written: after that nothing may fail.
  OuterPlanes outer_{};
  RefitFile<Layout> file_;
};

Result<RefitStatistics> run(CpuEngine& engine, std::span<std::byte> file, const SceneInput& moved,
                            const RefitOptions& options, bool& writing) {
  const auto view = open_buffer(file);
  if (!view) return tl::unexpected(invalid("not a BVH file to refit: " + to_string(view.error())));
  if (view->has_instances())
    return tl::unexpected(invalid("a scene of instances cannot be refitted, only its objects' files can"));
  if (auto sizes = check_sizes(moved); !sizes) return tl::unexpected(sizes.error());
  const BuildInput input(moved);
  if (auto checked = check_geometries(*view, input); !checked) return tl::unexpected(checked.error());
  return dispatch_layout(view->layout(), [&](auto layout) {
    return Refit<decltype(layout)>(engine, file, *view, input).run(options, writing);
  });
}

}  // namespace

Result<RefitStatistics> refit(std::span<std::byte> file, const SceneInput& moved, const RefitOptions& options) {
  return or_out_of_memory("for the refit", [&]() -> Result<RefitStatistics> {
    if (auto checked = check_options(options); !checked) return tl::unexpected(checked.error());
    bool writing = false;
    ProgressCallback progress;
    if (options.progress) progress = [&](const Progress& p) { return options.progress(p) || writing; };
    return run_cpu("refit", options.threads, progress,
                   [&](CpuEngine& engine) { return run(engine, file, moved, options, writing); });
  });
}

Result<RefittedBvh> refit_copy(std::span<const std::byte> file, const SceneInput& moved, const RefitOptions& options) {
  return run_cpu("refit", options.threads, options.progress, [&](CpuEngine& engine) -> Result<RefittedBvh> {
    if (auto checked = check_options(options); !checked) return tl::unexpected(checked.error());
    RefittedBvh result{Buffer(file.size()), {}};
    engine.ledger().add(file.size());
    if (!file.empty()) std::memcpy(result.buffer.bytes().data(), file.data(), file.size());
    bool writing = false;
    auto statistics = run(engine, result.buffer.bytes(), moved, options, writing);
    if (!statistics) return tl::unexpected(statistics.error());
    result.statistics = *statistics;
    return result;
  });
}

}  // namespace hiprt::build
