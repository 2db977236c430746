#include "builders.h"

#include <benchmarks/common/embree_scene.h>
#include <benchmarks/common/rounds.h>

#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/statistics.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace hiprt::bench {
namespace {

constexpr std::array kBuilders{build::Builder::kSah,       build::Builder::kLbvh,      build::Builder::kLbvh30,
                               build::Builder::kPloc,      build::Builder::kHploc,     build::Builder::kSbvh,
                               build::Builder::kHq,        build::Builder::kEmbreeLow, build::Builder::kEmbreeMedium,
                               build::Builder::kEmbreeHigh};

struct EmbreeKind {
  const char* name;
  RTCBuildQuality quality;
  RTCSceneFlags flags;
};
/// Robust scenes have one quality: Embree ignores higher ones.
constexpr std::array kEmbreeKinds{
    EmbreeKind{"rtc_low", RTC_BUILD_QUALITY_LOW, RTC_SCENE_FLAG_NONE},
    EmbreeKind{"rtc_medium", RTC_BUILD_QUALITY_MEDIUM, RTC_SCENE_FLAG_NONE},
    EmbreeKind{"rtc_high", RTC_BUILD_QUALITY_HIGH, RTC_SCENE_FLAG_NONE},
    EmbreeKind{"rtc_medium_robust", RTC_BUILD_QUALITY_MEDIUM, RTC_SCENE_FLAG_ROBUST},
};

/// The builders as contestants. After an error, which error() returns, the times are invalid.
class BuildContest {
 public:
  BuildContest(const Scene& scene, unsigned threads) : scene_(scene), threads_(threads) {}

  std::vector<Contestant> contestants() {
    std::vector<Contestant> all;
    all.reserve(kBuilders.size() + kEmbreeKinds.size());
    for (const build::Builder builder : kBuilders)
      all.push_back({build::name(builder), [this, builder] { return run(builder, nullptr); }});
    for (const EmbreeKind& kind : kEmbreeKinds)
      all.push_back({kind.name, [this, &kind] { return run(kind, nullptr); }});
    return all;
  }

  /// All figures except the times.
  std::vector<BuildEntry> figures() {
    std::vector<BuildEntry> entries;
    entries.reserve(kBuilders.size() + kEmbreeKinds.size());
    for (const build::Builder builder : kBuilders)
      run(builder, &entries.emplace_back(make_entry(build::name(builder))));
    for (const EmbreeKind& kind : kEmbreeKinds) run(kind, &entries.emplace_back(make_entry(kind.name)));
    const auto reference =
        std::find_if(entries.begin(), entries.end(), [](const BuildEntry& e) { return e.name == kReferenceTree; });
    const double cost = reference->sah_cost;
    for (BuildEntry& entry : entries) entry.cost_ratio = entry.sah_cost / cost;
    return entries;
  }

  const std::optional<build::Error>& error() const { return error_; }

 private:
  static BuildEntry make_entry(const char* name) {
    BuildEntry entry;
    entry.name = name;
    return entry;
  }

  double run(build::Builder builder, BuildEntry* entry) {
    const build::TriangleMesh input = scene_.input();
    std::optional<build::Result<build::Bvh>> bvh;
    const double seconds = time_of([&] {
      bvh.emplace(build::build({&input, 1}, {.builder = builder, .threads = threads_}));
    });
    if (!*bvh)
      error_ = bvh->error();
    else if (entry != nullptr)
      describe(**bvh, *entry);
    return seconds;
  }

  static void describe(const build::Bvh& bvh, BuildEntry& entry) {
    const build::TreeStatistics tree = build::measure_tree(*open_buffer(bvh.buffer.bytes()));
    entry.output_bytes = static_cast<double>(bvh.buffer.size());
    entry.peak_bytes = static_cast<double>(bvh.statistics.scratch_bytes_peak);
    entry.sah_cost = tree.sah_cost;
    entry.depth = tree.depth;
    entry.pair_fill = tree.pair_fill;
  }

  /// The time of rtcCommitScene, without copying the mesh.
  double run(const EmbreeKind& kind, BuildEntry* entry) {
    auto embree = EmbreeScene::make(scene_.mesh, {.flags = kind.flags, .quality = kind.quality, .threads = threads_});
    if (!embree) {
      error_ = embree.error();
      return 1;
    }
    build::Result<void> done;
    const double seconds = time_of([&] { done = embree->commit(); });
    if (!done) error_ = done.error();
    if (entry == nullptr) return seconds;
    entry->output_bytes = static_cast<double>(embree->bytes());
    entry->peak_bytes = static_cast<double>(embree->peak_bytes());
    return seconds;
  }

  const Scene& scene_;
  unsigned threads_;
  std::optional<build::Error> error_;
};

}  // namespace

build::Result<BuildCell> measure_builders(const Scene& scene, unsigned threads, unsigned rounds) {
  BuildContest contest(scene, threads);
  BuildCell cell{scene.name, threads, scene.mesh.triangles.size(), contest.figures()};
  const Timings seconds = run_rounds(contest.contestants(), rounds);
  if (contest.error()) return tl::unexpected(*contest.error());
  for (std::size_t i = 0; i < cell.entries.size(); ++i)
    cell.entries[i].mtri_s = static_cast<double>(cell.triangles) * 1e-6 / median(seconds[i]);
  return cell;
}

}  // namespace hiprt::bench
