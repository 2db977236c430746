#include "tables.h"

#include <benchmarks/common/program.h>
#include <benchmarks/common/summary.h>

#include <tools/render/tracers/tracer.h>

#include <cmath>

namespace hiprt::bench {
namespace {

std::string build_table(const BuilderCell& cell) {
  std::vector<Column<BuilderEntry>> columns{
      {"builder", [](const auto& entry) { return entry.name; }},
      {"seconds", [](const auto& entry) { return with_ratio(entry.seconds, 3, entry.seconds_ratio, 2); }},
      {"Mtri/s", [](const auto& entry) { return format_number(entry.mtri_s, 2); }},
      {"SAH cost", [](const auto& entry) { return with_ratio(entry.sah_cost, 2, entry.cost_ratio, 2); }},
      {"nodes", [](const auto& entry) { return format_number(entry.nodes, 0); }},
      {"bytes/tri", [](const auto& entry) { return format_number(entry.bytes_per_triangle, 1); }},
      {"scratch bytes/tri", [](const auto& entry) { return format_number(entry.scratch_bytes_per_triangle, 1); }}};
  if (!std::isnan(cell.entries.front().object_cost))
    columns.push_back({"cost of the object", [](const auto& entry) { return format_number(entry.object_cost, 2); }});
  return table(cell.entries, columns);
}

std::string trace_table(const BuilderCell& cell) {
  std::vector<Column<BuilderEntry>> columns{{"builder", [](const auto& entry) { return entry.name; }}};
  for (std::size_t i = 0; i < cell.entries.front().traced.size(); ++i) {
    const std::string& kind = cell.entries.front().traced[i].kind;
    columns.push_back({kind, [i](const auto& entry) {
                         const TracedKind& traced = entry.traced[i];
                         return with_ratio(traced.mrays_s, 3, 1 / traced.time_ratio, 2);
                       }});
    columns.push_back({kind + " tests", [i](const auto& entry) {
                         const TracedKind& traced = entry.traced[i];
                         return format_number(traced.box_tests, 1) + " / " + format_number(traced.leaf_tests, 1);
                       }});
  }
  columns.push_back({"mean time", [](const auto& entry) { return format_number(entry.trace_time_ratio, 3); }});
  return table(cell.entries, columns);
}

}  // namespace

std::string builders_markdown(const std::vector<BuilderCell>& cells, unsigned rounds) {
  std::string text = "## Builders\n\n" + compiler_name() + ", kernels for " + tools::trace_isa() + "; " +
                     rounds_text(rounds) + " In brackets: relative to " + std::string(kYardstick) +
                     ". Tests: four-box tests / leaf tests per ray.\n\n";
  for (const BuilderCell& cell : cells) {
    text += scene_heading(cell.scene, cell.triangles) + "\n\nBuilt by " + threads_text(cell.threads) + ":\n\n" +
            build_table(cell);
    text += "Mrays/s of one thread, default policies; mean time: geometric mean over the kinds, relative to " +
            std::string(kYardstick) + ":\n\n" + trace_table(cell);
  }
  return text;
}

}  // namespace hiprt::bench
