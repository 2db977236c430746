#include "record.h"

#include <benchmarks/common/rounds.h>
#include <benchmarks/common/summary.h>

#include <algorithm>
#include <array>
#include <limits>

namespace hiprt::bench {
namespace {

constexpr std::array<const char*, 3> kKinds{"primary", "secondary", "shadow"};

nlohmann::json wave_json(const TracedWave& wave) {
  nlohmann::json json{{"name", wave.name},
                      {"seconds", median(wave.seconds)},
                      {"rounds", wave.seconds},
                      {"differing_rays", wave.differing},
                      {"inexact_rays", wave.inexact}};
  if (wave.kinds)
    json["disagreements"] = {{"found", wave.kinds->found},
                             {"distance", wave.kinds->distance},
                             {"instance", wave.kinds->instance},
                             {"primitive", wave.kinds->primitive}};
  return json;
}

nlohmann::json build_json(const Entry& entry) {
  std::vector<double> all, objects, instances;
  for (const BuildSeconds& seconds : entry.builds) {
    all.push_back(seconds.all());
    objects.push_back(seconds.objects);
    instances.push_back(seconds.instances);
  }
  nlohmann::json json{{"seconds", median(all)},
                      {"object_seconds", median(objects)},
                      {"instance_seconds", median(instances)},
                      {"rounds", all}};
  if (entry.cpu_build) json["built_by"] = "cpu";
  return json;
}

nlohmann::json entry_json(const Entry& entry) {
  nlohmann::json json{{"tracer", entry.tracer},          {"builder", entry.builder},     {"form", entry.hierarchy},
                      {"build", build_json(entry)},      {"bytes", entry.figures.bytes}, {"sah_cost", nullptr},
                      {"waves", nlohmann::json::array()}};
  if (entry.figures.sah_cost) json["sah_cost"] = *entry.figures.sah_cost;
  if (entry.figures.compaction_seconds)
    json["compaction"] = {{"seconds", *entry.figures.compaction_seconds},
                          {"built_bytes", entry.figures.built_bytes},
                          {"scratch_bytes", entry.figures.scratch_bytes}};
  for (const TracedWave& wave : entry.waves) json["waves"].push_back(wave_json(wave));
  return json;
}

const WaveRecord& record_of(const SceneRecord& scene, const TracedWave& wave) {
  return *std::find_if(scene.waves.begin(), scene.waves.end(),
                       [&](const WaveRecord& record) { return record.name == wave.name; });
}

/// The sum over all waves. @return nothing if the tracer's hits were not compared by kind.
std::optional<Disagreements> all_disagreements(const Entry& entry) {
  std::optional<Disagreements> sum;
  for (const TracedWave& wave : entry.waves) {
    if (!wave.kinds) continue;
    if (!sum) sum.emplace();
    for (const auto member :
         {&Disagreements::found, &Disagreements::distance, &Disagreements::instance, &Disagreements::primitive})
      *sum.*member += *wave.kinds.*member;
  }
  return sum;
}

/// How the peers' hits differ from ours. Empty without such peers.
std::string disagreement_table(const SceneRecord& scene) {
  std::vector<Entry> entries;
  for (const Entry& entry : scene.entries)
    if (all_disagreements(entry)) entries.push_back(entry);
  if (entries.empty()) return {};
  const auto count = [](std::uint64_t Disagreements::*member) {
    return [member](const Entry& entry) { return std::to_string(*all_disagreements(entry).*member); };
  };
  const std::vector<Column<Entry>> columns{
      {"hits unlike ours", [](const auto& entry) { return entry.tracer + " " + entry.builder; }},
      {"hierarchy", [](const auto& entry) { return entry.hierarchy; }},
      {"hit or miss", count(&Disagreements::found)},
      {"distance", count(&Disagreements::distance)},
      {"instance", count(&Disagreements::instance)},
      {"primitive", count(&Disagreements::primitive)}};
  return table(entries, columns);
}

}  // namespace

nlohmann::json to_json(const SceneRecord& scene) {
  const auto list = nlohmann::json::array();
  nlohmann::json json{{"name", scene.name}, {"source", scene.source}, {"light", scene.light}, {"forms", list},
                      {"waves", list},      {"entries", list},        {"missing", list}};
  for (const HierarchyRecord& hierarchy : scene.hierarchies)
    json["forms"].push_back({{"name", hierarchy.name},
                             {"levels", hierarchy.levels},
                             {"triangles", hierarchy.triangles},
                             {"instances", hierarchy.instances}});
  for (const WaveRecord& wave : scene.waves)
    json["waves"].push_back({{"name", wave.name},
                             {"kind", wave.kind},
                             {"any_hit", wave.any_hit},
                             {"rays", wave.rays},
                             {"hits", wave.hits}});
  for (const Entry& entry : scene.entries) json["entries"].push_back(entry_json(entry));
  for (const Missing& missing : scene.missing)
    json["missing"].push_back(
        {{"tracer", missing.tracer}, {"builder", missing.builder}, {"form", missing.hierarchy}, {"why", missing.why}});
  return json;
}

double sample_seconds(const SceneRecord& scene, const Entry& entry, const std::string& kind) {
  double sum = 0;
  for (const TracedWave& wave : entry.waves)
    if (kind.empty() || record_of(scene, wave).kind == kind) sum += median(wave.seconds);
  return sum;
}

double mrays_per_second(const SceneRecord& scene, const Entry& entry, const std::string& kind) {
  std::uint64_t rays = 0;
  for (const WaveRecord& wave : scene.waves)
    if (wave.kind == kind) rays += wave.rays;
  if (rays == 0) return std::numeric_limits<double>::quiet_NaN();
  return 1e-6 * static_cast<double>(rays) / sample_seconds(scene, entry, kind);
}

double build_seconds(const Entry& entry) {
  std::vector<double> all;
  for (const BuildSeconds& seconds : entry.builds) all.push_back(seconds.all());
  return median(all);
}

std::string to_markdown(const SceneRecord& scene) {
  std::vector<Column<Entry>> columns{
      {"tracer", [](const auto& entry) { return entry.tracer; }},
      {"builder", [](const auto& entry) { return entry.builder + (entry.cpu_build ? " (built by the CPU)" : ""); }},
      {"hierarchy", [](const auto& entry) { return entry.hierarchy; }},
      {"build ms", [](const auto& entry) { return format_number(1e3 * build_seconds(entry), 2); }},
      {"SAH cost",
       [](const auto& entry) { return entry.figures.sah_cost ? format_number(*entry.figures.sah_cost, 1) : ""; }},
      {"MB", [](const auto& entry) { return format_number(1e-6 * static_cast<double>(entry.figures.bytes), 1); }}};
  for (const std::string kind : kKinds)
    columns.push_back({kind == kKinds[0] ? kind + " Mrays/s" : kind, [&scene, kind](const auto& entry) {
                         return format_number(mrays_per_second(scene, entry, kind), 2);
                       }});
  columns.push_back(
      {"sample ms", [&](const auto& entry) { return format_number(1e3 * sample_seconds(scene, entry), 2); }});
  columns.push_back({"differing rays", [](const auto& entry) {
                       std::uint64_t differing = 0;
                       for (const TracedWave& wave : entry.waves) differing += wave.differing;
                       return std::to_string(differing);
                     }});
  std::string text = "## " + scene.name + "\n\n" + table(scene.entries, columns) + disagreement_table(scene);
  for (const Missing& missing : scene.missing)
    text += "Not measured: " + missing.tracer + (missing.tracer.empty() ? "" : " ") + missing.builder +
            (missing.builder.empty() ? "" : " ") + missing.hierarchy + ": " + missing.why + "\n\n";
  return text;
}

}  // namespace hiprt::bench
