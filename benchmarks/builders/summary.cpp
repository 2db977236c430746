#include "summary.h"

#include <benchmarks/common/markdown.h>
#include <benchmarks/common/program.h>

#include <tools/render/tracers/tracer.h>

#include <cmath>

namespace hiprt::bench {
namespace {

std::string with_ratio(double value, int digits, double ratio) {
  return format_number(value, digits) + " (" + format_number(ratio, 2) + ")";
}

std::string build_table(const BuilderCell& cell) {
  const bool has_object = !std::isnan(cell.entries.front().object_cost);
  std::vector<std::string> head{"builder", "seconds", "Mtri/s", "SAH cost", "nodes", "bytes/tri", "scratch bytes/tri"};
  if (has_object) head.emplace_back("cost of the object");
  MarkdownTable table(head);
  for (const BuilderEntry& entry : cell.entries) {
    std::vector<std::string> row{entry.name,
                                 with_ratio(entry.seconds, 3, entry.seconds_ratio),
                                 format_number(entry.mtri_s, 2),
                                 with_ratio(entry.sah_cost, 2, entry.cost_ratio),
                                 format_number(entry.nodes, 0),
                                 format_number(entry.bytes_per_triangle, 1),
                                 format_number(entry.scratch_bytes_per_triangle, 1)};
    if (has_object) row.push_back(format_number(entry.object_cost, 2));
    table.add(std::move(row));
  }
  return table.text();
}

std::string trace_table(const BuilderCell& cell) {
  std::vector<std::string> head{"builder"};
  for (const TracedKind& kind : cell.entries.front().traced) {
    head.push_back(kind.kind);
    head.push_back(kind.kind + " tests");
  }
  head.emplace_back("mean time");
  MarkdownTable table(head);
  for (const BuilderEntry& entry : cell.entries) {
    std::vector<std::string> row{entry.name};
    for (const TracedKind& kind : entry.traced) {
      row.push_back(with_ratio(kind.mrays_s, 3, 1 / kind.time_ratio));
      row.push_back(format_number(kind.box_tests, 1) + " / " + format_number(kind.leaf_tests, 1));
    }
    row.push_back(format_number(entry.trace_time_ratio, 3));
    table.add(std::move(row));
  }
  return table.text();
}

}  // namespace

std::string builders_markdown(const std::vector<BuilderCell>& cells, unsigned rounds) {
  std::string text = "## Builders\n\n" + compiler_name() + ", kernels for " + tools::trace_isa() + "; " +
                     std::to_string(rounds) + " round(s) in turn; medians over the rounds. In brackets: relative to " +
                     std::string(kYardstick) + ". Tests: four-box tests / leaf tests per ray.\n\n";
  for (const BuilderCell& cell : cells) {
    text += "### " + cell.scene + ", " + std::to_string(cell.triangles) + " triangles\n\nBuilt by " +
            std::to_string(cell.threads) + (cell.threads == 1 ? " thread" : " threads") + ":\n\n" + build_table(cell);
    text += "Mrays/s of one thread, default policies; mean time: geometric mean over the kinds, relative to " +
            std::string(kYardstick) + ":\n\n" + trace_table(cell);
  }
  return text;
}

}  // namespace hiprt::bench
