#include "measured.h"

#include <benchmarks/common/markdown.h>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace hiprt::bench {
namespace {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}

double rate(const Measured& measured, double milliseconds) {
  return static_cast<double>(measured.triangles) / milliseconds / 1e3;
}

}  // namespace

Measured row_of(const std::string& scene, std::uint64_t triangles, const std::string& mode,
                const VulkanBuilds& builds) {
  std::string name = "Vulkan, " + mode + (builds.compaction_ms.empty() ? "" : ", compacted");
  std::replace(name.begin(), name.end(), '_', ' ');
  std::vector<double> times = builds.bottom_ms;
  for (std::size_t i = 0; i < builds.compaction_ms.size(); ++i) times[i] += builds.compaction_ms[i];
  const auto [least, most] = std::minmax_element(times.begin(), times.end());
  return {.scene = scene,
          .builder = name,
          .triangles = triangles,
          .output_bytes = builds.bytes.built,
          .scratch_bytes = builds.bytes.scratch,
          .file_bytes = builds.bytes.now,
          .min_ms = *least,
          .median_ms = median(times),
          .max_ms = *most,
          .vulkan = true,
          .compaction_ms = median(builds.compaction_ms),
          .top_level_ms = median(builds.top_ms)};
}

nlohmann::json to_json(const Measured& m) {
  nlohmann::json json{{"scene", m.scene},
                      {"builder", m.builder},
                      {"triangles", m.triangles},
                      {"min_ms", m.min_ms},
                      {"median_ms", m.median_ms},
                      {"max_ms", m.max_ms},
                      {"mtri_s", rate(m, m.median_ms)},
                      {"output_bytes", m.output_bytes},
                      {"scratch_bytes", m.scratch_bytes},
                      {"file_bytes", m.file_bytes}};
  if (m.vulkan)
    json.update({{"compaction_ms", m.compaction_ms}, {"top_level_ms", m.top_level_ms}});
  else
    json.update({{"refit_ms", m.refit_ms},
                 {"steps_ms", m.steps_ms},
                 {"scene_ms", m.scene_ms},
                 {"callback_gap_ms", m.callback_gap_ms},
                 {"steps_bytes", m.steps_bytes},
                 {"sah_cost", m.sah_cost},
                 {"pairs", m.report.pairs},
                 {"leaves", m.report.leaves},
                 {"nodes", m.report.nodes}});
  return json;
}

std::string table(const std::vector<Measured>& all) {
  MarkdownTable result({"scene", "builder", "triangles", "ms", "Mtri/s", "SAH cost", "pairs / triangle", "nodes / leaf",
                        "B/tri file", "B/tri output", "B/tri scratch", "steps ms", "B/tri steps", "scene ms",
                        "refit ms", "refit Mtri/s"});
  for (const Measured& m : all) {
    const auto per_triangle = [&](std::uint64_t count) {
      return format_number(static_cast<double>(count) / static_cast<double>(m.triangles), 2);
    };
    const auto ours = [&](double value, int digits) { return m.vulkan ? "" : format_number(value, digits); };
    result.add({m.scene, m.builder, std::to_string(m.triangles), format_number(m.median_ms, 3),
                format_number(rate(m, m.median_ms), 0), ours(m.sah_cost, 3),
                m.vulkan ? "" : per_triangle(m.report.pairs),
                ours(double{1} * m.report.nodes / std::max(1u, m.report.leaves), 3), per_triangle(m.file_bytes),
                per_triangle(m.output_bytes), per_triangle(m.scratch_bytes), ours(m.steps_ms, 3),
                m.vulkan ? "" : per_triangle(m.steps_bytes), ours(m.scene_ms, 3), ours(m.refit_ms, 3),
                ours(rate(m, m.refit_ms), 0)});
  }
  return result.text();
}

}  // namespace hiprt::bench
