/// Builders of hiprt and Embree, side by side in one process, the growth of their times, and the validation of files.

#include "tables.h"

#include <benchmark/benchmark.h>
#include <benchmarks/common/procedural.h>
#include <benchmarks/common/program.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <thread>

namespace hiprt::bench {
namespace {

constexpr std::string_view kHeightField = "height_field";
constexpr std::string_view kScattered = "scattered";

struct BuildBenchmarkOptions {
  SceneOptions scenes;
  unsigned rounds = 3;
  unsigned validation_rounds = 7;
  unsigned validation_triangles = 2'300'000;
  unsigned scattered_triangles = 1'000'000;
  unsigned growth_triangles = 200'000;
};

class BuildBenchmarks {
 public:
  explicit BuildBenchmarks(const BuildBenchmarkOptions& options) : options_(options) {}

  std::string add() {
    const auto scenes = find_scenes(options_.scenes);
    if (!scenes) return scenes.error().message;
    const unsigned all = std::max(1u, std::thread::hardware_concurrency());
    for (const std::string& scene : *scenes) {
      add_build(scene, 1);
      if (all > 1) add_build(scene, all);
      add_benchmark("validate/" + scene, [this, scene](benchmark::State& state) {
        if (load(state, scene)) run_validation(state, scene_->input(), scene);
      });
    }
    add_build(std::string(kScattered), 1);
    add_benchmark("validate/" + std::string(kHeightField), [this](benchmark::State& state) {
      const tools::Mesh mesh = height_field(options_.validation_triangles);
      run_validation(state, {.positions = mesh.positions, .triangles = mesh.triangles}, std::string(kHeightField));
    });
    for (const std::string mesh : kOverlapping)
      add_benchmark("growth/" + mesh, [this, mesh](benchmark::State& state) { run_growth(state, mesh); });
    return {};
  }

  Summary summarize() const { return {build_markdown(builds_, validations_, growths_, options_.rounds), {}}; }

 private:
  void add_build(const std::string& scene, unsigned threads) {
    add_benchmark("build/" + scene + "/threads_" + std::to_string(threads),
                  [this, scene, threads](benchmark::State& state) { run_build(state, scene, threads); });
  }

  /// Loads a scene and keeps it until another one is loaded. @return false after an error, which @p state reports.
  bool load(benchmark::State& state, const std::string& name) {
    if (scene_ != nullptr && scene_->name == name) return true;
    if (name == kScattered) {
      scene_ = std::make_unique<Scene>(Scene{name, scattered(procedural_mesh(options_.scattered_triangles))});
      return true;
    }
    auto loaded = load_scene(options_.scenes, name);
    if (!loaded) {
      state.SkipWithError(loaded.error().message.c_str());
      return false;
    }
    scene_ = std::make_unique<Scene>(std::move(*loaded));
    return true;
  }

  void run_build(benchmark::State& state, const std::string& name, unsigned threads) {
    if (!load(state, name)) return;
    for (auto _ : state) {
      auto cell = measure_builders(*scene_, threads, options_.rounds);
      if (!cell) {
        state.SkipWithError(cell.error().message.c_str());
        return;
      }
      report(state, *cell);
      builds_.push_back(std::move(*cell));
    }
  }

  static void report(benchmark::State& state, const BuildCell& cell) {
    const auto triangles = static_cast<double>(cell.triangles);
    state.counters["triangles"] = triangles;
    for (const BuildEntry& entry : cell.entries) {
      state.counters[entry.name + ".Mtri_s"] = entry.mtri_s;
      state.counters[entry.name + ".bytes_per_triangle"] = entry.output_bytes / triangles;
      state.counters[entry.name + ".peak_bytes"] = entry.peak_bytes;
      state.counters[entry.name + ".peak_to_output"] = entry.peak_bytes / entry.output_bytes;
      if (std::isnan(entry.sah_cost)) continue;
      state.counters[entry.name + ".sah_cost"] = entry.sah_cost;
      state.counters[entry.name + ".sah_cost_ratio"] = entry.cost_ratio;
      state.counters[entry.name + ".depth"] = entry.depth;
    }
  }

  void run_validation(benchmark::State& state, const build::TriangleMesh& mesh, const std::string& name) {
    for (auto _ : state) {
      auto cell = measure_validation(mesh, name, options_.validation_rounds);
      if (!cell) {
        state.SkipWithError(cell.error().message.c_str());
        return;
      }
      state.counters["triangles"] = static_cast<double>(cell->triangles);
      state.counters["file_bytes"] = static_cast<double>(cell->bytes);
      state.counters["seconds"] = cell->seconds;
      state.counters["Mtri_s"] = 1e-6 * static_cast<double>(cell->triangles) / cell->seconds;
      validations_.push_back(std::move(*cell));
    }
  }

  void run_growth(benchmark::State& state, const std::string& mesh) {
    for (auto _ : state) {
      auto cell = measure_growth(mesh, options_.growth_triangles, options_.rounds);
      if (!cell) {
        state.SkipWithError(cell.error().message.c_str());
        return;
      }
      state.counters["triangles"] = static_cast<double>(cell->triangles);
      for (const GrowthEntry& entry : cell->entries) {
        state.counters[entry.name + ".seconds"] = entry.seconds;
        state.counters[entry.name + ".growth"] = entry.growth;
        state.counters[entry.name + ".to_scattered"] = entry.to_scattered;
      }
      growths_.push_back(std::move(*cell));
    }
  }

  const BuildBenchmarkOptions& options_;
  std::unique_ptr<Scene> scene_;
  std::vector<BuildCell> builds_;
  std::vector<ValidationCell> validations_;
  std::vector<GrowthCell> growths_;
};

std::vector<Flag> flags(BuildBenchmarkOptions& options) {
  std::vector<Flag> flags = options.scenes.flags();
  flags.push_back(number_flag("rounds", "rounds in which all builders run in turn", options.rounds, 1, 10'000));
  flags.push_back(number_flag("validation-rounds", "validations of each file", options.validation_rounds, 1, 10'000));
  flags.push_back(number_flag("validation-triangles", "triangles of the validated height field, about",
                              options.validation_triangles, 2, 100'000'000));
  flags.push_back(number_flag("scattered-triangles",
                              "triangles of the mesh in random order with unshared vertices, about",
                              options.scattered_triangles, 2, 100'000'000));
  flags.push_back(
      number_flag("growth-triangles", "triangles of the overlapping meshes", options.growth_triangles, 4, 100'000'000));
  return flags;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  BuildBenchmarkOptions options;
  BuildBenchmarks benchmarks(options);
  return run_program(
      {"bench_build", "Builders of hiprt and Embree, side by side in the same process, and validation of files.",
       flags(options), [&] { return benchmarks.add(); }, [&] { return benchmarks.summarize(); }},
      argc, argv);
}
