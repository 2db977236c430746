/// Single-threaded tracing by hiprt and Embree, side by side in one process.

#include "tables.h"

#include <benchmark/benchmark.h>
#include <benchmarks/common/program.h>

#include <cmath>
#include <memory>
#include <string>

namespace hiprt::bench {
namespace {

struct TraceOptions {
  SceneOptions scenes;
  unsigned rays = 200'000;
  unsigned rounds = 9;
  unsigned most_disagreements = 300;  ///< Per million.
};

class TraceBenchmarks {
 public:
  explicit TraceBenchmarks(const TraceOptions& options) : options_(options) {}

  std::string add() {
    const auto scenes = find_scenes(options_.scenes);
    if (!scenes) return scenes.error().message;
    for (const std::string& scene : *scenes) {
      for (const std::string& kind : ray_kinds(options_.scenes, scene))
        add_benchmark("side_by_side/" + scene + "/" + kind,
                      [this, scene, kind](benchmark::State& state) { run_cell(state, scene, kind); });
      add_benchmark("geometric_mean/" + scene, [this, scene](benchmark::State& state) {
        report_mean(state, [&](const std::string& entry) { return cells_.mean_ratio(scene, entry); });
      });
    }
    add_benchmark("geometric_mean/scenes", [this](benchmark::State& state) {
      report_mean(state, [&](const std::string& entry) { return cells_.mean_ratio(entry); });
    });
    return {};
  }

  Summary summarize() const {
    Summary summary{trace_markdown(cells_, options_.rounds), {}};
    for (const Cell& cell : cells_.all())
      summary.faults.insert(summary.faults.end(), cell.faults.begin(), cell.faults.end());
    return summary;
  }

 private:
  /// Loads a scene and keeps it until another one is loaded.
  build::Result<void> load(const std::string& name) {
    if (scene_ != nullptr && scene_->name() == name) return {};
    scene_.reset();
    auto loaded = TraceScene::make(options_.scenes, name, options_.rays);
    if (!loaded) return tl::unexpected(loaded.error());
    scene_ = std::move(*loaded);
    return {};
  }

  void run_cell(benchmark::State& state, const std::string& name, const std::string& kind) {
    const auto loaded = load(name);
    const RaySet* rays = loaded ? scene_->rays(kind) : nullptr;
    if (rays == nullptr || rays->rays.empty()) {
      state.SkipWithError((loaded ? name + " has no " + kind + " rays" : loaded.error().message).c_str());
      return;
    }
    for (auto _ : state)
      cells_.add(measure(*scene_, *rays, options_.rounds, 1e-6 * static_cast<double>(options_.most_disagreements)));
    for (const Cell& cell : cells_.all())
      if (cell.scene == name && cell.kind == kind) report_cell(state, cell);
  }

  static void report_cell(benchmark::State& state, const Cell& cell) {
    state.counters["rays"] = static_cast<double>(cell.rays);
    for (const Entry& entry : cell.entries) {
      state.counters[entry.name + ".Mrays_s"] = entry.mrays_s;
      state.counters[entry.name + ".ratio"] = entry.ratio;
      state.counters[entry.name + ".disagreements"] = static_cast<double>(entry.disagreements);
      if (std::isnan(entry.box_tests)) continue;
      state.counters[entry.name + ".box_tests"] = entry.box_tests;
      state.counters[entry.name + ".leaf_tests"] = entry.leaf_tests;
    }
  }

  template <class Mean> static void report_mean(benchmark::State& state, const Mean& mean) {
    for (auto _ : state) {
    }
    for (const std::string& name : entry_names()) {
      const double ratio = mean(name);
      if (!std::isnan(ratio)) state.counters[name + ".ratio"] = ratio;
    }
  }

  const TraceOptions& options_;
  Cells cells_;
  std::unique_ptr<TraceScene> scene_;
};

std::vector<Flag> flags(TraceOptions& options) {
  std::vector<Flag> flags = options.scenes.flags();
  flags.push_back(number_flag("rays", "rays of each kind, about", options.rays, 64, 100'000'000));
  flags.push_back(number_flag("rounds", "rounds in which all tracers run in turn", options.rounds, 1, 10'000));
  flags.push_back(number_flag("most-disagreements",
                              "rays in a million on which an accurate tracer may disagree with Embree's robust one",
                              options.most_disagreements, 0, 1'000'000));
  return flags;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  TraceOptions options;
  TraceBenchmarks benchmarks(options);
  return run_program(
      {"bench_trace", "Rays per second of one thread: hiprt's tracers and Embree's, side by side in the same process.",
       flags(options), [&] { return benchmarks.add(); }, [&] { return benchmarks.summarize(); }},
      argc, argv);
}
