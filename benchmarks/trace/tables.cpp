#include "tables.h"

#include <benchmarks/common/program.h>
#include <benchmarks/common/rounds.h>
#include <benchmarks/common/summary.h>

#include <tools/render/tracers/tracer.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace hiprt::bench {
namespace {

std::string mean_table(const Cells& cells) {
  constexpr const char* kMean = "mean";
  std::vector<std::string> columns = cells.scenes();
  columns.emplace_back(kMean);
  return cross_table("tracer", entry_names(), columns, [&](const std::string& name, const std::string& column) {
    return format_number(column == kMean ? cells.mean_ratio(name) : cells.mean_ratio(column, name), 3);
  });
}

/// One row per tracer, one column per kind of rays.
std::string kinds_table(const std::vector<const Cell*>& cells, const std::function<std::string(const Entry&)>& text) {
  std::vector<std::string> kinds;
  for (const Cell* cell : cells) kinds.push_back(cell->kind);
  return cross_table("tracer", entry_names(), kinds, [&](const std::string& name, const std::string& kind) {
    const auto cell = std::find_if(cells.begin(), cells.end(), [&](const Cell* of) { return of->kind == kind; });
    return text((*cell)->entry(name));
  });
}

std::string speed(const Entry& entry) { return with_ratio(entry.mrays_s, 3, entry.ratio, 3); }

std::string work(const Entry& entry) {
  const std::string tests = std::isnan(entry.box_tests)
                                ? "-"
                                : format_number(entry.box_tests, 1) + " / " + format_number(entry.leaf_tests, 1);
  return tests + " / " + std::to_string(entry.disagreements);
}

std::string scene_tables(const Cells& cells, const std::string& scene) {
  const std::vector<const Cell*> of_scene = cells.of(scene);
  std::string text = "### " + scene + "\n\nMrays/s of one thread (ratio to embree_robust):\n\n";
  text += kinds_table(of_scene, speed);
  text += "Box tests / leaf tests per ray / rays that disagree with embree_robust, of";
  for (const Cell* cell : of_scene) text += " " + std::to_string(cell->rays) + " " + cell->kind;
  return text + ":\n\n" + kinds_table(of_scene, work);
}

}  // namespace

void Cells::add(Cell cell) {
  const auto same = [&](const Cell& old) { return old.scene == cell.scene && old.kind == cell.kind; };
  const auto old = std::find_if(cells_.begin(), cells_.end(), same);
  if (old == cells_.end())
    cells_.push_back(std::move(cell));
  else
    *old = std::move(cell);
}

std::vector<std::string> Cells::scenes() const {
  std::vector<std::string> scenes;
  for (const Cell& cell : cells_)
    if (std::find(scenes.begin(), scenes.end(), cell.scene) == scenes.end()) scenes.push_back(cell.scene);
  return scenes;
}

std::vector<const Cell*> Cells::of(const std::string& scene) const {
  std::vector<const Cell*> found;
  for (const Cell& cell : cells_)
    if (cell.scene == scene) found.push_back(&cell);
  return found;
}

double Cells::mean_ratio(const std::string& scene, const std::string& entry) const {
  std::vector<double> ratios;
  for (const Cell* cell : of(scene)) ratios.push_back(cell->entry(entry).ratio);
  return geometric_mean(ratios);
}

double Cells::mean_ratio(const std::string& entry) const {
  const std::vector<std::string> names = scenes();
  const bool only_procedural = names.size() == 1 && names[0] == kProceduralScene;
  std::vector<double> ratios;
  for (const std::string& scene : names)
    if (only_procedural || scene != kProceduralScene) ratios.push_back(mean_ratio(scene, entry));
  return geometric_mean(ratios);
}

std::string trace_markdown(const Cells& cells, unsigned rounds) {
  std::string text =
      "## Tracing, one thread\n\n" + compiler_name() + ", kernels for " + tools::trace_isa() +
      ", against Embree " RTC_VERSION_STRING " (rtcIntersect1, rtcOccluded1); " + rounds_text(rounds) +
      "\n\nSpeed relative to embree_robust, geometric mean over the kinds of rays; 'mean': over the scenes "
      "from files:\n\n";
  text += mean_table(cells);
  for (const std::string& scene : cells.scenes()) text += scene_tables(cells, scene);
  return text;
}

}  // namespace hiprt::bench
