#pragma once
/// What was measured, as one JSON schema for every device.

#include "competitor.h"
#include "waves.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace hiprt::bench {

inline constexpr const char* kEvaluationFormat = "hiprt bench_evaluation 1";

/// A competitor's rays of one wave.
struct TracedWave {
  std::string name;             ///< Wave::name.
  std::vector<double> seconds;  ///< By round.
  /// Rays whose answer is not that of the first form's first tree: hit or miss, or (closest hit) the distance.
  std::uint64_t differing = 0;
  /// Ours only: rays whose answer is not, to the last bit, that of the CPU through the form's first tree.
  std::uint64_t inexact = 0;
};

struct Entry {
  std::string tracer, builder, form;
  std::vector<BuildSeconds> builds;  ///< By round.
  TreeFigures figures;
  std::vector<TracedWave> waves;
};

/// What was not measured.
struct Missing {
  std::string tracer, builder, form;  ///< tracer, builder empty: nobody's.
  std::string why;
};

struct WaveRecord {
  std::string name, kind;
  bool any_hit = false;
  std::uint64_t rays = 0, hits = 0;
};

struct FormRecord {
  std::string name;
  unsigned levels = 0;
  std::uint64_t triangles = 0, instances = 0;
};

struct SceneRecord {
  std::string name, source, light;  ///< light: "point" or "sky".
  std::vector<FormRecord> forms;
  std::vector<WaveRecord> waves;
  std::vector<Entry> entries;
  std::vector<Missing> missing;
  std::vector<std::string> faults;  ///< Wrong answers.
};

nlohmann::json to_json(const SceneRecord& scene);

/// Seconds of one sample per pixel: the medians of all waves (of a kind), together.
double sample_seconds(const SceneRecord& scene, const Entry& entry, const std::string& kind = {});
/// 10^6 rays per second of the waves of a kind. @return NaN if there are none.
double mrays_per_second(const SceneRecord& scene, const Entry& entry, const std::string& kind);
/// The median over the rounds.
double build_seconds(const Entry& entry);

/// Markdown tables of the figures.
std::string to_markdown(const SceneRecord& scene);

}  // namespace hiprt::bench
