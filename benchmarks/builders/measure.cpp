#include "measure.h"

#include <benchmarks/common/rounds.h>

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/statistics.h>
#include <tests/oracle/cost_within.h>
#include <tests/oracle/opera_house.h>
#include <tools/cli/build/build_names.h>
#include <tools/render/tracers/tracer.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace hiprt::bench {
namespace {

constexpr std::size_t yardstick() {
  for (std::size_t i = 0; i < tools::kBuilders.size(); ++i)
    if (tools::kBuilders[i].first == kYardstick) return i;
  return tools::kBuilders.size();
}
static_assert(yardstick() < tools::kBuilders.size());

/// A file in memory, ready to be traced.
struct Tree {
  build::Bvh bvh;
  BufferView view;
  SceneView traced;
};

class TreeContest {
 public:
  TreeContest(Scene scene, std::vector<RaySet> rays, const build::BuildOptions& builds)
      : scene_(std::move(scene)), rays_(std::move(rays)), builds_(builds) {}

  build::Result<BuilderCell> run(unsigned rounds) {
    if (auto built = build_all(); !built) return tl::unexpected(built.error());
    BuilderCell cell{scene_.name, builds_.threads, scene_.mesh.triangles.size(), {}};
    for (std::size_t b = 0; b < trees_.size(); ++b) cell.entries.push_back(describe(b));
    for (BuilderEntry& entry : cell.entries) entry.cost_ratio = entry.sah_cost / cell.entries[yardstick()].sah_cost;
    time_builds(cell, rounds);
    for (const RaySet& set : rays_)
      if (auto traced = trace(cell, set, rounds); !traced) return tl::unexpected(traced.error());
    for (BuilderEntry& entry : cell.entries) {
      std::vector<double> ratios;
      for (const TracedKind& kind : entry.traced) ratios.push_back(kind.time_ratio);
      entry.trace_time_ratio = geometric_mean(ratios);
    }
    return cell;
  }

 private:
  build::Result<build::Bvh> built(std::size_t b) const {
    const build::TriangleMesh input = scene_.input();
    build::BuildOptions options = builds_;
    options.builder = tools::kBuilders[b].second;
    return build::build({&input, 1}, options);
  }

  build::Result<void> build_all() {
    for (std::size_t b = 0; b < tools::kBuilders.size(); ++b) {
      auto bvh = built(b);
      if (!bvh) return tl::unexpected(bvh.error());
      const BufferView view = *open_buffer(std::as_const(bvh->buffer).bytes());
      trees_.push_back({std::move(*bvh), view, make_scene_view(view)});
    }
    return {};
  }

  BuilderEntry describe(std::size_t b) const {
    const Tree& tree = trees_[b];
    const build::TreeStatistics statistics = build::measure_tree(tree.view);
    const auto triangles = static_cast<double>(std::max<std::size_t>(1, scene_.mesh.triangles.size()));
    const auto bytes = static_cast<double>(tree.bvh.buffer.size());
    BuilderEntry entry;
    entry.name = tools::kBuilders[b].first;
    entry.sah_cost = statistics.sah_cost;
    entry.nodes = static_cast<double>(statistics.nodes);
    entry.bytes_per_triangle = bytes / triangles;
    entry.scratch_bytes_per_triangle = static_cast<double>(tree.bvh.statistics.scratch_bytes_peak) / triangles;
    if (scene_.name == kOperaHouseScene) entry.object_cost = oracle::cost_within(tree.view, oracle::opera_object_box());
    return entry;
  }

  void time_builds(BuilderCell& cell, unsigned rounds) const {
    std::vector<Contestant> contestants;
    for (std::size_t b = 0; b < trees_.size(); ++b)
      contestants.push_back({cell.entries[b].name, [this, b] {
                               std::optional<build::Result<build::Bvh>> bvh;
                               return time_of([&] { bvh.emplace(built(b)); });
                             }});
    const Timings seconds = run_rounds(contestants, rounds);
    for (std::size_t b = 0; b < trees_.size(); ++b) {
      BuilderEntry& entry = cell.entries[b];
      entry.seconds = median(seconds[b]);
      entry.seconds_ratio = median_speed_ratio(seconds[yardstick()], seconds[b]);
      entry.mtri_s = 1e-6 * static_cast<double>(cell.triangles) / entry.seconds;
    }
  }

  build::Result<void> trace(BuilderCell& cell, const RaySet& set, unsigned rounds) const {
    const tools::Query query = set.any_hit ? tools::Query::kAny : tools::Query::kClosest;
    std::vector<Hit> hits(set.rays.size()), first;
    std::vector<tools::RayCost> costs(set.rays.size());
    const auto run = [&](std::size_t b, std::span<tools::RayCost> count) {
      tools::trace(trees_[b].traced, query, {}, set.rays, hits, count);
    };
    std::vector<Contestant> contestants;
    for (std::size_t b = 0; b < trees_.size(); ++b) {
      run(b, costs);
      if (b == 0) first = hits;
      if (!same_hits(first, hits, set.any_hit))
        return tl::unexpected(build::Error{build::ErrorCode::kBackend, cell.scene + ", " + set.kind +
                                                                           " rays: " + cell.entries[b].name + " and " +
                                                                           cell.entries[0].name + " have other hits"});
      cell.entries[b].traced.push_back(
          {set.kind, 0, 0, per_ray(costs, &tools::RayCost::box_tests), per_ray(costs, &tools::RayCost::leaf_tests)});
      contestants.push_back({cell.entries[b].name, [&run, b] { return time_of([&] { run(b, {}); }); }});
    }
    const Timings seconds = run_rounds(contestants, rounds);
    for (std::size_t b = 0; b < trees_.size(); ++b) {
      TracedKind& kind = cell.entries[b].traced.back();
      kind.mrays_s = 1e-6 * static_cast<double>(set.rays.size()) / median(seconds[b]);
      kind.time_ratio = median_speed_ratio(seconds[yardstick()], seconds[b]);
    }
    return {};
  }

  static bool same_hits(std::span<const Hit> a, std::span<const Hit> b, bool any_hit) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](const Hit& x, const Hit& y) {
      return any_hit ? x.found() == y.found() : x.t == y.t && x.geometry == y.geometry && x.primitive == y.primitive;
    });
  }

  static double per_ray(std::span<const tools::RayCost> costs, std::uint32_t tools::RayCost::*tests) {
    double sum = 0;
    for (const tools::RayCost& cost : costs) sum += cost.*tests;
    return costs.empty() ? 0 : sum / static_cast<double>(costs.size());
  }

  Scene scene_;
  std::vector<RaySet> rays_;
  build::BuildOptions builds_;
  std::vector<Tree> trees_;  ///< One per builder, in the order of tools::kBuilders.
};

}  // namespace

build::Result<BuilderCell> measure_trees(const SceneOptions& options, const std::string& scene,
                                         const std::vector<std::string>& kinds, std::uint32_t wanted_rays,
                                         const build::BuildOptions& builds, unsigned rounds) {
  auto loaded = load_scene(options, scene);
  if (!loaded) return tl::unexpected(loaded.error());
  auto rays = load_rays(options, *loaded, wanted_rays);
  if (!rays) return tl::unexpected(rays.error());
  std::erase_if(*rays, [&](const RaySet& set) {
    return set.rays.empty() || std::find(kinds.begin(), kinds.end(), set.kind) == kinds.end();
  });
  if (rays->empty())
    return tl::unexpected(build::Error{build::ErrorCode::kIo, scene + " has no rays of the wanted kinds"});
  return TreeContest(std::move(*loaded), std::move(*rays), builds).run(rounds);
}

}  // namespace hiprt::bench
