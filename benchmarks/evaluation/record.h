#pragma once
/// The measurements. The JSON schema is the same for all devices.

#include "competitor.h"
#include "waves.h"

#include <benchmarks/trace/agreement.h>

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace hiprt::bench {

inline constexpr const char* kEvaluationFormat = "hiprt bench_evaluation 1";

/// Times and differences of a competitor for one wave.
struct TracedWave {
  std::string name;             ///< Wave::name.
  std::vector<double> seconds;  ///< By round.
  /// Rays that differ from the first hierarchy's first BVH in hit or miss or, for closest hits, in distance.
  std::uint64_t differing = 0;
  /// Ours only: rays that differ in any bit from the CPU's hits with the hierarchy's first BVH.
  std::uint64_t inexact = 0;
  /// Vulkan's only: rays whose hits differ from the CPU's with the same hierarchy's first BVH, by kind.
  std::optional<Disagreements> kinds{};
};

struct Entry {
  std::string tracer, builder, hierarchy;
  std::vector<BuildSeconds> builds;  ///< By round.
  bool cpu_build = false;            ///< Competitor::cpu_builds_for_gpu().
  TreeFigures figures;
  std::vector<TracedWave> waves;
};

/// A combination that was not measured.
struct Missing {
  std::string tracer, builder, hierarchy;  ///< tracer and builder are empty if it applies to all.
  std::string why;
};

struct WaveRecord {
  std::string name, kind;
  bool any_hit = false;
  std::uint64_t rays = 0, hits = 0;
};

struct HierarchyRecord {
  std::string name;
  unsigned levels = 0;
  std::uint64_t triangles = 0, instances = 0;
};

struct SceneRecord {
  std::string name, source, light;  ///< light: "point" or "sky".
  std::vector<HierarchyRecord> hierarchies;
  std::vector<WaveRecord> waves;
  std::vector<Entry> entries;
  std::vector<Missing> missing;
  std::vector<std::string> faults;  ///< Wrong results.
};

nlohmann::json to_json(const SceneRecord& scene);

/// Seconds of one sample per pixel: sum of the medians of all waves (of a kind).
double sample_seconds(const SceneRecord& scene, const Entry& entry, const std::string& kind = {});
/// 10^6 rays per second of the waves of a kind. @return NaN if there are none.
double mrays_per_second(const SceneRecord& scene, const Entry& entry, const std::string& kind);
/// The median over the rounds.
double build_seconds(const Entry& entry);

/// Markdown tables of the figures.
std::string to_markdown(const SceneRecord& scene);

}  // namespace hiprt::bench
