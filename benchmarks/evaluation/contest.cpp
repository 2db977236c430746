#include "contest.h"

#include "host_trace.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

namespace hiprt::bench {
namespace {

/// Launches before the timed ones: a GPU loads code and raises its clocks.
constexpr unsigned kGpuWarmUp = 2;

/// A competitor and its measurements.
struct Seat {
  std::unique_ptr<Competitor> competitor;
  Entry entry;
};

bool is_missing(const build::Error& error) {
  using build::ErrorCode;
  return error.code == ErrorCode::kTooLarge || error.code == ErrorCode::kOutOfMemory ||
         error.code == ErrorCode::kNoDevice;
}

class Contest {
 public:
  Contest(const SourceScene& scene, const ContestOptions& options, const Machine& machine,
          const std::function<void(const char*, double)>& progress)
      : scene_(scene), options_(options), machine_(machine), progress_(progress) {
    record_.name = scene.name;
    record_.source = scene.source;
    record_.light = scene.light ? "point" : "sky";
  }

  build::Result<SceneRecord> run() {
    if (auto made = make_forms(); !made) return tl::unexpected(std::move(made.error()));
    seat_all();
    if (auto built = build_all(); !built) return tl::unexpected(std::move(built.error()));
    if (auto prepared = for_all([](Seat& seat) { return seat.competitor->prepare(); }); !prepared)
      return tl::unexpected(std::move(prepared.error()));
    const auto first =
        std::find_if(seats_.begin(), seats_.end(), [](const Seat& seat) { return seat.competitor->view() != nullptr; });
    if (first == seats_.end()) return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, why_nothing()});
    for (Seat& seat : seats_) {
      seat.entry.figures = seat.competitor->figures();
      seat.entry.cpu_build = seat.competitor->cpu_builds_for_gpu();
    }
    const std::vector<Wave> waves = make_waves(*first->competitor->view(), scene_, options_.picture, machine_.limit);
    for (std::size_t i = 0; i < waves.size(); ++i)
      if (auto traced = trace(waves[i], static_cast<double>(i) / static_cast<double>(waves.size())); !traced)
        return tl::unexpected(std::move(traced.error()));
    for (Seat& seat : seats_) record_.entries.push_back(std::move(seat.entry));
    return std::move(record_);
  }

 private:
  std::string why_nothing() const {
    std::string text = scene_.name + ": nothing could be measured";
    if (!record_.missing.empty()) text += ": " + record_.missing.front().hierarchy + ": " + record_.missing.front().why;
    return text;
  }

  build::Result<void> make_forms() {
    for (const std::string& name : options_.hierarchies) {
      if (name == "deep" && levels_of(scene_.description) < 2) continue;
      auto hierarchy = make_hierarchy(scene_, name, options_.most_triangles);
      if (!hierarchy && !is_missing(hierarchy.error())) return tl::unexpected(std::move(hierarchy.error()));
      if (!hierarchy) {
        record_.missing.push_back({"", "", name, hierarchy.error().message});
        continue;
      }
      hierarchies_.push_back(std::make_unique<Hierarchy>(std::move(*hierarchy)));
      const Hierarchy& made = *hierarchies_.back();
      record_.hierarchies.push_back({made.name, made.levels, made.triangles, made.instances});
    }
    return {};
  }

  void seat_all() {
    for (const auto& hierarchy : hierarchies_) {
      for (const std::string& builder : options_.builders) seat(make_hiprt(builder, *hierarchy, machine_));
      for (const std::string& mode : options_.peers) {
        if (machine_.gpu)
          record_.missing.push_back({"embree", mode, hierarchy->name, "Embree traces on CPUs only"});
        else
          seat(make_embree(mode, *hierarchy, machine_.limit));
      }
      for (const std::string& mode : options_.vulkan) {
        if (machine_.vulkan == nullptr)
          record_.missing.push_back({"vulkan", mode, hierarchy->name, machine_.why_no_vulkan});
        else
          seat(make_vulkan(mode, *hierarchy, machine_.vulkan));
      }
    }
  }

  void seat(std::unique_ptr<Competitor> competitor) {
    Entry entry;
    entry.tracer = competitor->tracer();
    entry.builder = competitor->builder();
    entry.hierarchy = competitor->hierarchy().name;
    seats_.push_back({std::move(competitor), std::move(entry)});
  }

  /// Removes competitors that do not support the hierarchy. @return other errors.
  build::Result<void> for_all(const std::function<build::Result<void>(Seat&)>& work) {
    for (std::size_t i = 0; i < seats_.size();) {
      const auto done = work(seats_[i]);
      if (done) {
        ++i;
        continue;
      }
      const Entry& entry = seats_[i].entry;
      if (!is_missing(done.error()))
        return tl::unexpected(build::Error{
            done.error().code, scene_.name + ": " + seats_[i].competitor->name() + ": " + done.error().message});
      record_.missing.push_back({entry.tracer, entry.builder, entry.hierarchy, done.error().message});
      seats_.erase(seats_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    return {};
  }

  /// All competitors in turn; each round starts with another one.
  build::Result<void> round_of(unsigned round, const std::function<build::Result<void>(Seat&)>& work) {
    if (!seats_.empty())
      std::rotate(seats_.begin(), seats_.begin() + static_cast<std::ptrdiff_t>(round % seats_.size()), seats_.end());
    auto done = for_all(work);
    std::sort(seats_.begin(), seats_.end(), [&](const Seat& a, const Seat& b) { return place(a) < place(b); });
    return done;
  }

  /// Order of the results: hierarchies and builders as on the command line; ours, Embree's, Vulkan's.
  std::array<std::ptrdiff_t, 3> place(const Seat& seat) const {
    const auto index = [](const std::vector<std::string>& words, const std::string& word) {
      return std::find(words.begin(), words.end(), word) - words.begin();
    };
    static const std::vector<std::string> tracers{"hiprt", "embree", "vulkan"};
    const std::ptrdiff_t tracer = index(tracers, seat.entry.tracer);
    const auto& builders = tracer == 0 ? options_.builders : tracer == 1 ? options_.peers : options_.vulkan;
    return {index(options_.hierarchies, seat.entry.hierarchy), tracer, index(builders, seat.entry.builder)};
  }

  build::Result<void> build_all() {
    const unsigned warm_up = machine_.gpu ? kGpuWarmUp : 0, rounds = warm_up + options_.build_rounds;
    std::size_t done = 0;
    for (unsigned round = 0; round < rounds; ++round) {
      auto built = round_of(round, [&](Seat& seat) -> build::Result<void> {
        progress_("build", static_cast<double>(done++) / static_cast<double>(rounds * seats_.size()));
        const auto seconds = seat.competitor->build();
        if (!seconds) return tl::unexpected(seconds.error());
        if (round >= warm_up) seat.entry.builds.push_back(*seconds);
        return {};
      });
      if (!built) return built;
    }
    return {};
  }

  build::Result<void> trace(const Wave& wave, double begun) {
    std::vector<Hit> hits(wave.rays.size());
    if (auto compared = compare(wave, hits); !compared) return compared;
    const auto waves = static_cast<double>(std::max<std::size_t>(1, 2 * options_.picture.bounces + 2));
    for (unsigned round = 0; round < options_.rounds; ++round) {
      progress_("trace", std::min(1.0, begun + round / (waves * options_.rounds)));
      auto traced = round_of(round, [&](Seat& seat) -> build::Result<void> {
        const auto seconds = seat.competitor->trace(wave.any_hit, wave.rays, hits);
        if (!seconds) return tl::unexpected(seconds.error());
        seat.entry.waves.back().seconds.push_back(*seconds);
        return {};
      });
      if (!traced) return traced;
    }
    return {};
  }

  /// The CPU's hits with the first BVH of each hierarchy.
  struct Reference {
    std::vector<Hit> hits;
    std::vector<std::uint32_t> instances;  ///< Of closest hits in two levels, for Vulkan.
  };
  struct References {
    std::map<std::string, Reference> of;  ///< By hierarchy.
    std::string first;                    ///< The first hierarchy.
    float reach = 0;                      ///< Its largest coordinate.
  };

  References trace_references(const Wave& wave) const {
    References all;
    for (const Seat& seat : seats_) {
      const SceneView* view = seat.competitor->view();
      if (view == nullptr || all.of.contains(seat.entry.hierarchy)) continue;
      Reference& reference = all.of[seat.entry.hierarchy];
      reference.hits.resize(wave.rays.size());
      if (machine_.vulkan != nullptr && view->levels == 1 && !wave.any_hit)
        reference.instances.resize(wave.rays.size());
      trace_on_host(*view, wave.any_hit, wave.rays, reference.hits, machine_.limit, reference.instances);
      if (!all.first.empty()) continue;
      all.first = seat.entry.hierarchy;
      for (int axis = 0; axis < 3; ++axis)
        all.reach = std::max({all.reach, std::abs(view->bounds.min[axis]), std::abs(view->bounds.max[axis])});
    }
    return all;
  }

  /// Compares the hits of all competitors. The traces also warm up.
  build::Result<void> compare(const Wave& wave, std::vector<Hit>& hits) {
    const References references = trace_references(wave);
    const std::vector<Hit>& first = references.of.at(references.first).hits;
    const auto found = std::count_if(first.begin(), first.end(), [](const Hit& hit) { return hit.found(); });
    record_.waves.push_back({wave.name, wave.kind, wave.any_hit, wave.rays.size(), static_cast<std::uint64_t>(found)});
    return for_all([&](Seat& seat) -> build::Result<void> {
      const auto seconds = seat.competitor->trace(wave.any_hit, wave.rays, hits);
      if (!seconds) return tl::unexpected(seconds.error());
      TracedWave traced{.name = wave.name, .seconds = {}};
      traced.differing = count_disagreements(hits, first, wave.any_hit, references.reach);
      const auto own = references.of.find(seat.entry.hierarchy);
      if (seat.entry.tracer == "vulkan" && own != references.of.end())
        traced.kinds = find_disagreements({hits, seat.competitor->instances()},
                                          {own->second.hits, own->second.instances}, wave.any_hit, references.reach);
      if (seat.competitor->view() != nullptr) traced.inexact = count_inexact(hits, own->second.hits, wave.any_hit);
      judge(seat, traced, wave);
      seat.entry.waves.push_back(std::move(traced));
      return {};
    });
  }

  void judge(const Seat& seat, const TracedWave& traced, const Wave& wave) {
    const std::string rays = " of " + std::to_string(wave.rays.size()) + " rays of " + scene_.name + ", " + wave.name;
    const std::string name = seat.competitor->name();
    if (traced.inexact != 0)
      record_.faults.push_back(name + " differs from the hierarchy's first BVH on " + std::to_string(traced.inexact) +
                               rays);
    const bool judged =
        seat.entry.tracer == "hiprt" || (seat.entry.builder == "robust" && seat.entry.hierarchy == "flat");
    const auto allowed =
        static_cast<std::uint64_t>(std::ceil(1e-6 * options_.most_differing * static_cast<double>(wave.rays.size())));
    if (judged && traced.differing > allowed)
      record_.faults.push_back(name + " differs from the first hierarchy's first BVH on " +
                               std::to_string(traced.differing) + rays + " (limit: " + std::to_string(allowed) + ")");
  }

  const SourceScene& scene_;
  const ContestOptions& options_;
  const Machine& machine_;
  const std::function<void(const char*, double)>& progress_;
  std::vector<std::unique_ptr<Hierarchy>> hierarchies_;
  std::vector<Seat> seats_;
  SceneRecord record_;
};

}  // namespace

build::Result<SceneRecord> run_contest(const SourceScene& scene, const ContestOptions& options, const Machine& machine,
                                       const std::function<void(const char* step, double fraction)>& progress) {
  return Contest(scene, options, machine, progress).run();
}

}  // namespace hiprt::bench
