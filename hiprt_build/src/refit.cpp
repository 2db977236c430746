#include <hiprt_build/exec/run_cpu.h>
#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/refit.h>
#include <hiprt_build/src/check_input.h>
#include <hiprt_build/src/provenance.h>
#include <hiprt_build/statistics.h>
#include <hiprt_build/steps/refit_file.h>
#include <hiprt_device/format/checksum.h>

#include <cstring>

namespace hiprt::build {
namespace {

std::uint64_t number_of(const SceneInput& scene) { return scene.meshes.size() + scene.customs.size(); }

Result<void> check_options(const RefitOptions& options) {
  if (options.rebuild_ratio >= 1.0) return {};
  return tl::unexpected(
      invalid("rebuild_ratio is " + std::to_string(options.rebuild_ratio) + ", it must be at least 1"));
}

/// The moved scene has the file's geometries.
Result<void> check_geometries(const BufferView& view, const PrimitiveSoup& soup) {
  if (soup.geometries() != view.geometries.size())
    return tl::unexpected(invalid(std::to_string(soup.geometries()) + " geometries, but the file to refit has " +
                                  std::to_string(view.geometries.size())));
  for (std::size_t g = 0; g < soup.geometries(); ++g) {
    const GeometryRecord& record = view.geometries[g];
    const bool custom = g >= soup.meshes.size();
    if (custom != ((record.flags & kGeometryCustom) != 0))
      return tl::unexpected(invalid(place(soup, g) + ": geometry " + std::to_string(g) + " of the file to refit is " +
                                    (custom ? "a mesh" : "of custom primitives")));
    if (soup.size(g) != record.primitive_count)
      return tl::unexpected(invalid(place(soup, g) + ": " + std::to_string(soup.size(g)) +
                                    (custom ? " primitives" : " triangles") + ", but the file to refit has " +
                                    std::to_string(record.primitive_count)));
    if (custom && soup.customs[g - soup.meshes.size()].type != custom_type(record.flags))
      return tl::unexpected(invalid(place(soup, g) + ": type " +
                                    std::to_string(soup.customs[g - soup.meshes.size()].type) +
                                    ", but in the file to refit type " + std::to_string(custom_type(record.flags))));
  }
  return {};
}

const char* reason(MoveFault fault, bool custom) {
  switch (fault) {
    case MoveFault::kNotFinite:
      return custom ? "is in the tree, but its box is not finite now" : "is in the tree, but is not finite now";
    case MoveFault::kInverted:
      return "is in the tree, but its box is inverted now";
    case MoveFault::kTooLarge:
      return "has a coordinate of 2^126 (8.5e37) or more now, which node layout quantized cannot hold";
    default:
      return "was dropped by the build, and is good now: that needs a new build";
  }
}

/// Finds the first primitive that cannot stay where it is in the tree, or out of it.
Result<void> check_primitives(CpuEngine& engine, const BufferView& view, const PrimitiveSoup& soup,
                              std::span<const MovedGeometry> geometries) {
  const float limit = view.layout() == NodeLayout::kQuantized ? kQuantizedLimit : kNoLimit;
  for (std::size_t g = 0; g < geometries.size(); ++g) {
    const auto fault = [&](std::size_t i) {
      const bool in_tree = view.primitive_map[soup.first[g] + i] != kInvalidId;
      return move_fault(geometries[g], static_cast<std::uint32_t>(i), in_tree, limit);
    };
    const std::size_t i = engine.find_first(soup.size(g), [&](std::size_t k) { return fault(k) != MoveFault::kNone; });
    if (i != soup.size(g))
      return tl::unexpected(invalid(place(soup, g, i) + reason(fault(i), geometries[g].is_custom())));
  }
  return {};
}

std::vector<MovedGeometry> moved_geometries(const PrimitiveSoup& soup) {
  std::vector<MovedGeometry> result;
  result.reserve(soup.geometries());
  for (const TriangleMesh& mesh : soup.meshes)
    result.push_back({reinterpret_cast<const float*>(mesh.positions.data()),
                      reinterpret_cast<const std::uint32_t*>(mesh.triangles.data()), nullptr});
  for (const CustomGeometry& custom : soup.customs) result.push_back({nullptr, nullptr, custom.boxes.data()});
  return result;
}

/// A file in memory on its way.
template <class Layout> class Refit {
 public:
  Refit(CpuEngine& engine, std::span<std::byte> bytes, const BufferView& view, const PrimitiveSoup& soup)
      : engine_(engine),
        bytes_(bytes),
        view_(view),
        soup_(soup),
        geometries_(moved_geometries(soup)),
        ways_(engine.allocate<std::uint32_t>(view.nodes.count)),
        file_{reinterpret_cast<FileHeader*>(bytes.data()),
              reinterpret_cast<typename Layout::Node*>(bytes.data() + view.nodes.offset),
              reinterpret_cast<typename Layout::Leaf*>(bytes.data() + view.leaves.offset),
              view.nodes.offset,
              view.leaves.offset,
              geometries_.data(),
              ways_.data(),
              &outer_} {}

  /// @param writing set once nothing can go wrong and the first byte is about to be written.
  Result<RefitStatistics> run(double rebuild_ratio, bool& writing) {
    Stopwatch total, watch;
    RefitStatistics statistics{.nodes = view_.nodes.count, .leaves = view_.leaves.count};
    engine_.monitor().start("check", 0.3, 2 * soup_.size() + view_.leaves.count);
    if (auto checked = check(); !checked) return tl::unexpected(checked.error());
    BuiltCost built = read_built_cost(view_.provenance);
    if (!built.sah_cost) built.sah_cost = measure_tree(view_, built.costs).sah_cost;
    statistics.check_seconds = watch.lap();
    engine_.monitor().start("refit", 0.8, view_.leaves.count + 2 * view_.nodes.count);
    writing = true;
    write();
    statistics.write_seconds = watch.lap();
    advise(statistics, built, rebuild_ratio);
    statistics.measure_seconds = watch.lap();
    engine_.monitor().start("checksum", 1.0, 1);
    file_.header->checksum = file_checksum(bytes_);
    statistics.scratch_bytes_peak = engine_.ledger().peak();
    statistics.total_seconds = total.lap();
    return statistics;
  }

 private:
  Result<void> check() {
    if (auto indices = check_indices(engine_, soup_); !indices) return indices;
    if (auto primitives = check_primitives(engine_, view_, soup_, geometries_); !primitives) return primitives;
    return check_pairs();
  }

  /// Finds the first pair of triangles that a leaf can hold no longer.
  Result<void> check_pairs() {
    const std::size_t leaves = view_.leaves.count;
    const std::size_t i = engine_.find_first(
        leaves, [&](std::size_t k) { return has_come_apart(file_.geometries, file_.leaves[k].info); });
    if (i == leaves) return {};
    const LeafInfo& info = file_.leaves[i].info;
    return tl::unexpected(invalid(place(soup_, info.geometry_and_flags & kGeometryMask, info.primitive[0]) +
                                  "its edge with triangle " + std::to_string(info.primitive[1]) +
                                  ", with which it shares a leaf, has come apart: that needs a new build (without "
                                  "pairs every motion can be refitted)"));
  }

  void write() {
    engine_.for_each(view_.nodes.count, LinkUpStep<Layout>{file_});
    engine_.for_each(view_.leaves.count, MoveLeafStep<Layout>{file_});
    engine_.for_each(view_.nodes.count, RefitNodeStep<Layout>{file_});
    if (file_.header->root != kInvalidRef) MoveBoundsStep<Layout>{file_}(0);
  }

  void advise(RefitStatistics& statistics, const BuiltCost& built, double rebuild_ratio) const {
    const Box& bounds = file_.header->bounds;
    unsigned extents = 0;
    for (unsigned axis = 0; axis < 3; ++axis) extents += bounds.max[axis] > bounds.min[axis] ? 1 : 0;
    statistics.sah_cost = measure_tree(view_, built.costs).sah_cost;
    statistics.sah_cost_built = *built.sah_cost;
    // On a line or in a point the cost is a count, which a build does not change.
    if (extents >= 2 && statistics.sah_cost_built > 0)
      statistics.cost_ratio = statistics.sah_cost / statistics.sah_cost_built;
    statistics.rebuild_advised = statistics.cost_ratio > rebuild_ratio;
  }

  CpuEngine& engine_;
  std::span<std::byte> bytes_;
  const BufferView& view_;
  const PrimitiveSoup& soup_;
  std::vector<MovedGeometry> geometries_;
  ScratchArray<std::uint32_t> ways_;
  OuterPlanes outer_{};
  RefitFile<Layout> file_;
};

Result<RefitStatistics> run(CpuEngine& engine, std::span<std::byte> file, const SceneInput& moved,
                            const RefitOptions& options, bool& writing) {
  const auto view = open_buffer(file);
  if (!view) return tl::unexpected(invalid("not a BVH file to refit: " + to_string(view.error())));
  const PrimitiveSoup soup(moved);
  if (auto checked = check_geometries(*view, soup); !checked) return tl::unexpected(checked.error());
  return dispatch_layout(view->layout(), [&](auto layout) {
    return Refit<decltype(layout)>(engine, file, *view, soup).run(options.rebuild_ratio, writing);
  });
}

}  // namespace

Result<RefitStatistics> refit(std::span<std::byte> file, const SceneInput& moved, const RefitOptions& options) {
  if (auto checked = check_options(options); !checked) return tl::unexpected(checked.error());
  bool writing = false;
  ProgressCallback progress;
  if (options.progress) progress = [&](const Progress& p) { return options.progress(p) || writing; };
  return run_cpu("refit", number_of(moved), options.threads, progress,
                 [&](CpuEngine& engine) { return run(engine, file, moved, options, writing); });
}

Result<RefittedBvh> refit_copy(std::span<const std::byte> file, const SceneInput& moved, const RefitOptions& options) {
  if (auto checked = check_options(options); !checked) return tl::unexpected(checked.error());
  return run_cpu("refit", number_of(moved), options.threads, options.progress,
                 [&](CpuEngine& engine) -> Result<RefittedBvh> {
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
