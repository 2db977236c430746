#include "summary.h"

#include <benchmarks/common/markdown.h>
#include <benchmarks/common/program.h>

#include <embree3/rtcore_config.h>

#include <cmath>

namespace hiprt::bench {
namespace {

std::string number_or_dash(double value, int digits) { return std::isnan(value) ? "-" : format_number(value, digits); }

std::string build_table(const BuildCell& cell) {
  MarkdownTable table({"builder", "Mtri/s", "bytes/tri", "peak / output", "SAH cost",
                       "/ " + std::string(kReferenceTree), "depth", "leaf fill"});
  for (const BuildEntry& entry : cell.entries) {
    const bool ours = !std::isnan(entry.sah_cost);
    table.add({entry.name, format_number(entry.mtri_s, 3),
               format_number(entry.output_bytes / static_cast<double>(cell.triangles), 1),
               format_number(entry.peak_bytes / entry.output_bytes, 2), number_or_dash(entry.sah_cost, 2),
               number_or_dash(entry.cost_ratio, 3), ours ? std::to_string(entry.depth) : "-",
               ours ? format_number(entry.pair_fill, 3) : "-"});
  }
  return table.text();
}

std::string validation_table(const std::vector<ValidationCell>& cells) {
  MarkdownTable table({"file", "triangles", "MB", "seconds", "Mtri/s", "MB/s"});
  for (const ValidationCell& cell : cells) {
    const double megabytes = 1e-6 * static_cast<double>(cell.bytes);
    table.add({cell.scene, std::to_string(cell.triangles), format_number(megabytes, 1), format_number(cell.seconds, 3),
               format_number(1e-6 * static_cast<double>(cell.triangles) / cell.seconds, 2),
               format_number(megabytes / cell.seconds, 0)});
  }
  return table.text();
}

}  // namespace

std::string build_markdown(const std::vector<BuildCell>& builds, const std::vector<ValidationCell>& validations,
                           unsigned rounds) {
  std::string text = "## Building\n\n" + compiler_name() +
                     ", against Embree " RTC_VERSION_STRING " (rtc_*: rtcCommitScene); " + std::to_string(rounds) +
                     " round(s) in turn; medians over the rounds. Peak and output of rtc_* are what its device holds, "
                     "the copy of the mesh included.\n\n";
  for (const BuildCell& cell : builds)
    text += "### " + cell.scene + ", " + std::to_string(cell.triangles) + " triangles, " +
            std::to_string(cell.threads) + (cell.threads == 1 ? " thread\n\n" : " threads\n\n") + build_table(cell);
  if (!validations.empty())
    text += "## Validation of files\n\nMapping, validate() and unmapping; one thread; from the file cache.\n\n" +
            validation_table(validations);
  return text;
}

}  // namespace hiprt::bench
