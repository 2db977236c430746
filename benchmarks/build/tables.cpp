#include "tables.h"

#include <benchmarks/common/program.h>
#include <benchmarks/common/summary.h>

#include <hiprt_build/embree/rtcore.h>

#include <cmath>

namespace hiprt::bench {
namespace {

std::string build_table(const BuildCell& cell) {
  const auto is_ours = [](const BuildEntry& entry) { return !std::isnan(entry.sah_cost); };
  const auto triangles = static_cast<double>(cell.triangles);
  return table<BuildEntry>(
      cell.entries,
      {{"builder", [](const auto& entry) { return entry.name; }},
       {"Mtri/s", [](const auto& entry) { return format_number(entry.mtri_s, 3); }},
       {"bytes/tri", [&](const auto& entry) { return format_number(entry.output_bytes / triangles, 1); }},
       {"peak / output", [](const auto& entry) { return format_number(entry.peak_bytes / entry.output_bytes, 2); }},
       {"SAH cost", [](const auto& entry) { return number_or_dash(entry.sah_cost, 2); }},
       {"/ " + std::string(kReferenceTree), [](const auto& entry) { return number_or_dash(entry.cost_ratio, 3); }},
       {"depth", [&](const auto& entry) { return is_ours(entry) ? std::to_string(entry.depth) : "-"; }},
       {"leaf fill", [&](const auto& entry) { return is_ours(entry) ? format_number(entry.pair_fill, 3) : "-"; }}});
}

std::string validation_table(const std::vector<ValidationCell>& cells) {
  const auto megabytes = [](const ValidationCell& cell) { return 1e-6 * static_cast<double>(cell.bytes); };
  const auto millions = [](const ValidationCell& cell) { return 1e-6 * static_cast<double>(cell.triangles); };
  return table<ValidationCell>(
      cells, {{"file", [](const auto& cell) { return cell.scene; }},
              {"triangles", [](const auto& cell) { return std::to_string(cell.triangles); }},
              {"MB", [&](const auto& cell) { return format_number(megabytes(cell), 1); }},
              {"seconds", [](const auto& cell) { return format_number(cell.seconds, 3); }},
              {"Mtri/s", [&](const auto& cell) { return format_number(millions(cell) / cell.seconds, 2); }},
              {"MB/s", [&](const auto& cell) { return format_number(megabytes(cell) / cell.seconds, 0); }}});
}

std::string growth_table(const GrowthCell& cell) {
  return table<GrowthEntry>(cell.entries,
                            {{"builder", [](const auto& entry) { return entry.name; }},
                             {"seconds", [](const auto& entry) { return format_number(entry.seconds, 2); }},
                             {"/ a quarter", [](const auto& entry) { return format_number(entry.growth, 2); }},
                             {"/ scattered", [](const auto& entry) { return format_number(entry.to_scattered, 2); }}});
}

}  // namespace

std::string build_markdown(const std::vector<BuildCell>& builds, const std::vector<ValidationCell>& validations,
                           const std::vector<GrowthCell>& growths, unsigned rounds) {
  std::string text = "## Building\n\n" + compiler_name() +
                     ", against Embree " RTC_VERSION_STRING " (rtc_*: rtcCommitScene); " + rounds_text(rounds) +
                     " Peak and output of rtc_* are what its device holds, the copy of the mesh included.\n\n";
  for (const BuildCell& cell : builds)
    text += scene_heading(cell.scene, cell.triangles) + ", " + threads_text(cell.threads) + "\n\n" + build_table(cell);
  if (!validations.empty())
    text += "## Validation of files\n\nMapping, validate() and unmapping; one thread; from the file cache.\n\n" +
            validation_table(validations);
  if (!growths.empty())
    text +=
        "## Growth\n\nMeshes whose triangles overlap, one thread. The time relative to that of a quarter of the "
        "triangles, and to that of as many small triangles that seldom overlap.\n\n";
  for (const GrowthCell& cell : growths) text += scene_heading(cell.mesh, cell.triangles) + "\n\n" + growth_table(cell);
  return text;
}

}  // namespace hiprt::bench
