/// Every builder: build time, size, quality and traversal speed.

#include "tables.h"

#include <benchmark/benchmark.h>
#include <benchmarks/common/program.h>

#include <algorithm>
#include <cmath>
#include <thread>

namespace hiprt::bench {
namespace {

struct BuilderOptions {
  SceneOptions scenes;
  std::vector<std::string> kinds{"primary", "ao", "diffuse"};
  std::string splits = "default";
  unsigned rays = 200'000;
  unsigned rounds = 5;
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
};

class BuilderBenchmarks {
 public:
  explicit BuilderBenchmarks(const BuilderOptions& options) : options_(options) {}

  std::string add() {
    auto scenes = find_scenes(options_.scenes);
    if (!scenes) return scenes.error().message;
    if (options_.scenes.names.empty()) scenes->emplace_back(kOperaHouseScene);
    for (const std::string& scene : *scenes)
      add_benchmark("builders/" + scene, [this, scene](benchmark::State& state) { run(state, scene); });
    return {};
  }

  Summary summarize() const { return {builders_markdown(cells_, options_.rounds), {}}; }

 private:
  void run(benchmark::State& state, const std::string& scene) {
    for (auto _ : state) {
      // With lbvh30 a few rays of this scene take a millisecond.
      const unsigned rays = scene == kOperaHouseScene ? std::max(64u, options_.rays / 10) : options_.rays;
      build::BuildOptions builds{.threads = options_.threads};
      if (options_.splits == "auto") builds.split_budget = build::kSplitsAsNeeded;
      auto cell = measure_trees(options_.scenes, scene, options_.kinds, rays, builds, options_.rounds);
      if (!cell) {
        state.SkipWithError(cell.error().message.c_str());
        return;
      }
      report(state, *cell);
      cells_.push_back(std::move(*cell));
    }
  }

  static void report(benchmark::State& state, const BuilderCell& cell) {
    state.counters["triangles"] = static_cast<double>(cell.triangles);
    state.counters["build_threads"] = cell.threads;
    for (const BuilderEntry& entry : cell.entries) {
      const auto set = [&](const std::string& name, double value) { state.counters[entry.name + "." + name] = value; };
      set("seconds", entry.seconds);
      set("seconds_ratio", entry.seconds_ratio);
      set("Mtri_s", entry.mtri_s);
      set("sah_cost", entry.sah_cost);
      set("sah_cost_ratio", entry.cost_ratio);
      set("nodes", entry.nodes);
      set("bytes_per_triangle", entry.bytes_per_triangle);
      set("scratch_bytes_per_triangle", entry.scratch_bytes_per_triangle);
      if (!std::isnan(entry.object_cost)) set("object_cost", entry.object_cost);
      for (const TracedKind& kind : entry.traced) {
        set(kind.kind + ".Mrays_s", kind.mrays_s);
        set(kind.kind + ".time_ratio", kind.time_ratio);
        set(kind.kind + ".box_tests", kind.box_tests);
        set(kind.kind + ".leaf_tests", kind.leaf_tests);
      }
      set("trace_time_ratio", entry.trace_time_ratio);
    }
  }

  const BuilderOptions& options_;
  std::vector<BuilderCell> cells_;
};

std::vector<Flag> flags(BuilderOptions& options) {
  std::vector<Flag> flags = options.scenes.flags();
  flags.push_back(list_flag("kinds", "KIND,...", "kinds of rays (primary,ao,diffuse)", options.kinds));
  flags.push_back(
      number_flag("rays", "rays per kind, about; a tenth for the opera house", options.rays, 64, 100'000'000));
  flags.push_back(number_flag("rounds", "rounds in which all builders run in turn, and all BVHs are traced in turn",
                              options.rounds, 1, 10'000));
  flags.push_back(word_flag("splits", "split budgets: default or auto, as bvhbuild --split-budget auto (default)",
                            options.splits, {"default", "auto"}));
  flags.push_back(number_flag("threads", "threads of the builds", options.threads, 1, 4096));
  return flags;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  BuilderOptions options;
  BuilderBenchmarks benchmarks(options);
  return run_program({"bench_builders",
                      "Every builder of hiprt: build time, SAH cost, size, and the speed of primary, ao and diffuse "
                      "rays, relative to\n"
                      "PLOC. 'opera_house' shows the effect of 30-bit Morton codes on small detail in a large scene.",
                      flags(options), [&] { return benchmarks.add(); }, [&] { return benchmarks.summarize(); }},
                     argc, argv);
}
