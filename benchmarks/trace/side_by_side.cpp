#include "side_by_side.h"

#include "agreement.h"
#include "embree_trace.h"

#include <benchmarks/common/rounds.h>

#include <algorithm>

namespace hiprt::bench {
namespace {

KernelJob make_job(const TraceScene& scene, const RaySet& set, const Variant& variant, std::vector<Hit>& hits) {
  return {.scene = &scene.view(variant),
          .any_hit = set.any_hit,
          .tests = variant.tests,
          .lanes = variant.lanes,
          .rays = set.rays.data(),
          .hits = hits.data(),
          .count = set.rays.size(),
          .work = nullptr};
}

std::vector<Contestant> make_contestants(const TraceScene& scene, const RaySet& set, std::vector<Hit>& hits) {
  std::vector<Contestant> contestants;
  const auto add_embree = [&](std::string_view name, RTCScene embree) {
    contestants.push_back({std::string(name), [&set, &hits, embree] {
                             return time_of([&] { embree_trace(embree, set.any_hit, set.rays, hits); });
                           }});
  };
  add_embree(kEmbreeRobust, scene.embree_robust());
  add_embree(kEmbreeDefault, scene.embree_default());
  const bool coherent = set.kind == "primary" || set.kind == "shadow";
  contestants.push_back({std::string(kEmbreeEight), [&set, &hits, coherent, embree = scene.embree_default()] {
                           return time_of([&] { embree_trace_eight(embree, set.any_hit, coherent, set.rays, hits); });
                         }});
  for (const Variant& variant : kVariants)
    contestants.push_back({std::string(variant.name),
                           [job = make_job(scene, set, variant, hits)] { return time_of([&] { run_kernel(job); }); }});
  return contestants;
}

void count_work(const TraceScene& scene, const RaySet& set, Cell& cell) {
  std::vector<Hit> hits(set.rays.size());
  const double rays = static_cast<double>(set.rays.size());
  for (Entry& entry : cell.entries) {
    const auto* variant =
        std::find_if(kVariants.begin(), kVariants.end(), [&](const Variant& v) { return v.name == entry.name; });
    if (variant == kVariants.end() || variant->lanes != Lanes::kDefault || variant->tests == Tests::kReference)
      continue;
    Work work;
    KernelJob job = make_job(scene, set, *variant, hits);
    job.work = &work;
    run_kernel(job);
    entry.box_tests = static_cast<double>(work.box_tests) / rays;
    entry.leaf_tests = static_cast<double>(work.leaf_tests) / rays;
  }
}

/// Traces once with every tracer for the comparison of hits. The traces also warm up.
void compare_hits(const TraceScene& scene, const RaySet& set, const std::vector<Contestant>& contestants,
                  const std::vector<Hit>& hits, double most, Cell& cell) {
  std::vector<Hit> robust, exact;
  const float reach = scene.reach();
  const auto allowed = static_cast<std::uint64_t>(most * static_cast<double>(set.rays.size()));
  const std::string rays = " of " + std::to_string(set.rays.size()) + " " + set.kind + " rays of " + cell.scene;
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    contestants[i].run();
    if (i == 0) robust = hits;
    Entry& entry = cell.entries[i];
    entry.disagreements = count_disagreements(hits, robust, set.any_hit, reach);
    const auto* variant =
        std::find_if(kVariants.begin(), kVariants.end(), [&](const Variant& v) { return v.name == entry.name; });
    if (variant == kVariants.end() || variant->tests != Tests::kAccurate) continue;
    if (exact.empty()) exact = hits;
    if (entry.disagreements > allowed)
      cell.faults.push_back(entry.name + " disagrees with " + std::string(kEmbreeRobust) + " on " +
                            std::to_string(entry.disagreements) + rays + " (limit: " + std::to_string(allowed) + ")");
    if (const std::uint64_t inexact = count_inexact(hits, exact, set.any_hit); inexact != 0)
      cell.faults.push_back(entry.name + " differs from " + std::string(kVariants[0].name) + " on " +
                            std::to_string(inexact) + rays);
  }
}

}  // namespace

const Entry& Cell::entry(std::string_view name) const {
  return *std::find_if(entries.begin(), entries.end(), [&](const Entry& entry) { return entry.name == name; });
}

std::vector<std::string> entry_names() {
  std::vector<std::string> names{std::string(kEmbreeRobust), std::string(kEmbreeDefault), std::string(kEmbreeEight)};
  for (const Variant& variant : kVariants) names.emplace_back(variant.name);
  return names;
}

Cell measure(const TraceScene& scene, const RaySet& set, unsigned rounds, double most_disagreements) {
  Cell cell{scene.name(), set.kind, set.any_hit, set.rays.size(), {}, {}};
  for (const std::string& name : entry_names()) cell.entries.push_back({.name = name});
  std::vector<Hit> hits(set.rays.size());
  const std::vector<Contestant> contestants = make_contestants(scene, set, hits);
  compare_hits(scene, set, contestants, hits, most_disagreements, cell);
  count_work(scene, set, cell);
  const Timings seconds = run_rounds(contestants, rounds);
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    cell.entries[i].mrays_s = static_cast<double>(cell.rays) * 1e-6 / median(seconds[i]);
    cell.entries[i].ratio = median_speed_ratio(seconds[i], seconds[0]);
  }
  return cell;
}

}  // namespace hiprt::bench
