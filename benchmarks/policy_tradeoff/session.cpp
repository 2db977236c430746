#include "session.h"

#include "errors.h"
#include "instanced_spheres.h"

#include <benchmarks/common/rounds.h>

#include <tests/oracle/meshes.h>
#include <tools/cli/progress.h>

#include <algorithm>
#include <utility>

namespace hiprt::bench {
namespace {

struct NamedQuestion {
  CheckKind kind;
  const char* name;
};
constexpr NamedQuestion kAimed[] = {
    {CheckKind::kRandom, "random"}, {CheckKind::kEdge, "edges"}, {CheckKind::kVertex, "vertices"}};
constexpr NamedQuestion kBoxes{CheckKind::kBoxes, "boxes"}, kSpawned{CheckKind::kSpawned, "spawned"};

class Session {
 public:
  Session(Engine& engine, std::vector<Subject> subjects, const SessionOptions& options)
      : options_(options), engine_(engine) {
    record_.subjects = std::move(subjects);
  }

  build::Result<TradeoffRecord> run() {
    build::Result<void> done;
    if (wants("speed")) done = measure_speed();
    if (done) done = check_models();
    if (done && wants("errors")) done = compare();
    if (done && wants("places")) done = measure_spheres();
    if (!done) return tl::unexpected(done.error());
    return std::move(record_);
  }

 private:
  build::Result<void> set_model(const Model& model, Trees& trees) {
    auto built = build_trees(model);
    if (!built) return tl::unexpected(built.error());
    trees = std::move(*built);
    return engine_.set_model(model, trees);
  }

  build::Result<void> measure_speed() {
    const auto names = find_scenes(options_.scenes);
    if (!names) return tl::unexpected(names.error());
    for (const std::string& name : *names) {
      bar_.update((name + ": speed").c_str(), 0);
      auto scene = load_scene(options_.scenes, name);
      if (!scene) return tl::unexpected(scene.error());
      auto sets = load_rays(options_.scenes, *scene, options_.speed_rays);
      if (!sets) return tl::unexpected(sets.error());
      const Model model = make_model(name, std::move(scene->mesh));
      Trees trees;
      if (auto set = set_model(model, trees); !set) return set;
      for (const RaySet& set : *sets)
        if (!set.any_hit)
          if (auto timed = time_rays(model, trees, set); !timed) return timed;
    }
    return {};
  }

  build::Result<void> time_rays(const Model& model, const Trees& trees, const RaySet& set) {
    const std::vector<Subject>& subjects = record_.subjects;
    std::vector<Hit> hits(set.rays.size());
    build::Result<void> status;
    std::vector<Contestant> contestants;
    contestants.reserve(subjects.size());
    for (const Subject& subject : subjects)
      contestants.push_back({subject.name, [&] {
                               const auto seconds = engine_.trace(subject, set.rays, hits);
                               if (!seconds) status = tl::unexpected(seconds.error());
                               return seconds ? *seconds : 1.0;
                             }});
    // The first round warms up.
    run_rounds(contestants, 1);
    const Timings seconds = run_rounds(contestants, options_.rounds);
    if (!status) return status;
    for (std::size_t i = 0; i < subjects.size(); ++i) {
      SpeedRow row{subjects[i].name, model.name, set.kind, set.rays.size(), seconds[i]};
      row.relative = median_speed_ratio(seconds[i], seconds[0]);
      if (subjects[i].ours)
        row.bytes_per_triangle =
            static_cast<double>(trees[layout_index(kPolicySets[subjects[i].set].layout)].buffer.size()) /
            static_cast<double>(std::max<std::size_t>(1, model.mesh.triangles.size()));
      record_.speeds.push_back(std::move(row));
    }
    return {};
  }

  bool wants(std::string_view name) const {
    return std::find(options_.questions.begin(), options_.questions.end(), name) != options_.questions.end();
  }

  build::Result<void> run_check(const Model& model, const NamedQuestion& check, float tmin = -1.0f,
                                const std::string& origin = {}) {
    const std::uint64_t count = std::uint64_t{options_.aimed_thousands} * 1000;
    for (const Subject& subject : record_.subjects) {
      // Embree's boxes cannot be widened, and it has no error bounds.
      const bool own = check.kind == CheckKind::kBoxes || (check.kind == CheckKind::kSpawned && tmin < 0.0f);
      if (!subject.ours && own) continue;
      if (!subject.vulkan.empty() && !VulkanScenes::can_check(check.kind)) continue;
      bar_.update((model.name + ": " + check.name + ": " + subject.name).c_str(), fraction_);
      const auto tally = engine_.check(subject, {check.kind, tmin, 0.0f, {}}, count);
      if (!tally) return tl::unexpected(tally.error());
      record_.faults.push_back({subject.name, model.name, check.name, origin, count, *tally});
    }
    return {};
  }

  build::Result<void> check_leaks(const Model& model) {
    for (const NamedQuestion& check : kAimed)
      if (wants(check.name))
        if (auto done = run_check(model, check); !done) return done;
    return {};
  }

  build::Result<void> check_boxes(const Model& model) {
    return wants(kBoxes.name) ? run_check(model, kBoxes) : build::Result<void>();
  }

  build::Result<void> check_spawned(const Model& model) {
    if (!wants(kSpawned.name)) return {};
    if (auto done = run_check(model, kSpawned, -1.0f, "spawn_origin"); !done) return done;
    for (const auto& [tmin, origin] : {std::pair{0.0f, "tmin 0"}, {1e-5f, "tmin 1e-5"}, {1e-3f, "tmin 1e-3"}})
      if (auto done = run_check(model, kSpawned, tmin, origin); !done) return done;
    return {};
  }

  build::Result<void> check_models() {
    const oracle::Mesh star = oracle::star(4, 11), sphere = oracle::icosphere(4),
                       box = oracle::subdivided_box(12, 1.9, 12);
    struct CheckedModel {
      Model model;
      build::Result<void> (Session::*check)(const Model&);
    };
    const std::vector<CheckedModel> all{
        {make_model("star", star, 0.05), &Session::check_leaks},
        {make_model("sphere", sphere, 0.5), &Session::check_leaks},
        {make_model("box", box, 0.9), &Session::check_leaks},
        // Few triangles, because a ray that enters every box tests them all.
        {make_model("box", oracle::subdivided_box(3, 1.9, 3), 0.9), &Session::check_boxes},
        {make_model("sphere", oracle::icosphere(1), 0.5), &Session::check_boxes},
        {make_model("sphere", sphere, 0.5), &Session::check_spawned},
        {make_model("star", star, 0.05), &Session::check_spawned},
        {make_model("sphere, radius 10 at 1e4", sphere, 0.5, 10, {1e4, 1e4, 1e4}), &Session::check_spawned}};
    for (const CheckedModel& checked : all) {
      fraction_ += 1.0 / static_cast<double>(all.size());
      Trees trees;
      if (auto set = set_model(checked.model, trees); !set) return set;
      if (auto done = (this->*checked.check)(checked.model); !done) return done;
    }
    return {};
  }

  build::Result<void> compare() {
    bar_.update("exact hits", 1.0);
    for (const ErrorCase& errors : error_cases(options_.error_rays)) {
      Trees trees;
      if (auto set = set_model(errors.model, trees); !set) return set;
      std::vector<Hit> hits(errors.rays.size());
      for (const Subject& subject : record_.subjects) {
        // Vulkan's shaders write no u, v and normal.
        if (!subject.vulkan.empty()) continue;
        // Hits do not depend on the layout.
        if (subject.ours && kPolicySets[subject.set].layout != NodeLayout::kPlanes) continue;
        const auto traced = engine_.trace(subject, errors.rays, hits);
        if (!traced) return tl::unexpected(traced.error());
        record_.errors.push_back({subject.name, errors.model.name, measure_errors(errors, hits, subject.ours)});
      }
    }
    return {};
  }

  build::Result<void> measure_spheres() {
    auto spheres = make_instanced_spheres();
    if (!spheres) return tl::unexpected(spheres.error());
    for (const InstancedSphere& sphere : *spheres)
      if (auto done = measure_sphere(sphere); !done) return done;
    return {};
  }

  build::Result<void> measure_sphere(const InstancedSphere& sphere) {
    if (auto set = engine_.set_sphere(sphere); !set) return set;
    std::vector<std::size_t> chosen;
    for (std::size_t i = 0; i < record_.subjects.size(); ++i)
      if (engine_.can_trace_sphere(record_.subjects[i])) chosen.push_back(i);
    const InstancedRays instanced = instanced_rays(sphere, options_.error_rays);
    std::vector<Ray> rays;
    // Fewer on a CPU: 16 levels take long.
    const unsigned timed = !engine_.is_gpu() ? options_.speed_rays / 10 : options_.speed_rays;
    while (rays.size() < timed) rays.insert(rays.end(), instanced.rays.begin(), instanced.rays.end());
    bar_.update((sphere.name + ": speed").c_str(), 1.0);
    const auto seconds = time_each(chosen, rays);
    if (!seconds) return tl::unexpected(seconds.error());
    Trees trees;
    if (auto set = set_model(sphere.model, trees); !set) return set;
    const auto flat_seconds = time_each(chosen, rays);
    if (!flat_seconds) return tl::unexpected(flat_seconds.error());
    if (auto set = engine_.set_sphere(sphere); !set) return set;
    std::vector<Hit> hits(instanced.rays.size());
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      const Subject& subject = record_.subjects[chosen[k]];
      InstancedRow row{subject.name, sphere.name, (*flat_seconds)[k] / (*seconds)[k], {}, 0, {}};
      bar_.update((sphere.name + ": " + subject.name).c_str(), 1.0);
      if (const auto traced = engine_.trace(subject, instanced.rays, hits); !traced)
        return tl::unexpected(traced.error());
      row.errors = measure_instanced(sphere, instanced, hits, subject.ours);
      if (subject.ours) {
        row.spawned = std::uint64_t{options_.aimed_thousands} * 1000;
        const auto tally = engine_.check(subject, {CheckKind::kSpawned, -1.0f, sphere.time, {}}, row.spawned);
        if (!tally) return tl::unexpected(tally.error());
        row.tally = *tally;
      }
      record_.spheres.push_back(std::move(row));
    }
    return {};
  }

  /// @return the median seconds of each subject.
  build::Result<std::vector<double>> time_each(const std::vector<std::size_t>& subjects, const std::vector<Ray>& rays) {
    std::vector<Hit> hits(rays.size());
    std::vector<std::vector<double>> seconds(subjects.size());
    for (unsigned round = 0; round <= options_.rounds; ++round)
      for (std::size_t k = 0; k < subjects.size(); ++k) {
        const auto traced = engine_.trace(record_.subjects[subjects[k]], rays, hits);
        if (!traced) return tl::unexpected(traced.error());
        // The first round warms up.
        if (round != 0) seconds[k].push_back(*traced);
      }
    std::vector<double> medians;
    medians.reserve(seconds.size());
    for (const std::vector<double>& of : seconds) medians.push_back(median(of));
    return medians;
  }

  const SessionOptions& options_;
  Engine& engine_;
  TradeoffRecord record_;
  tools::ProgressBar bar_;
  double fraction_ = 0.0;  ///< Of the models.
};

}  // namespace

std::vector<std::string> question_names() {
  return {"speed", "random", "edges", "vertices", "boxes", "spawned", "errors", "places"};
}

build::Result<TradeoffRecord> run_session(Engine& engine, std::vector<Subject> subjects,
                                          const SessionOptions& options) {
  return Session(engine, std::move(subjects), options).run();
}

std::vector<std::string> broken_guarantees(const TradeoffRecord& record) {
  std::vector<std::string> broken;
  const auto promised = [&](const std::string& name) {
    const auto subject =
        std::find_if(record.subjects.begin(), record.subjects.end(), [&](const Subject& s) { return s.name == name; });
    return subject->ours && subject->compiler == "usual" && subject->boxes == "Conservative" &&
           subject->triangle != "Fast";
  };
  for (const FaultRow& row : record.faults)
    if (promised(row.subject) && row.tally.faults + row.tally.lost != 0 &&
        (row.kind != "spawned" || row.origin == "spawn_origin"))
      broken.push_back(row.subject + ": " + row.model + ": " + row.kind + ": " +
                       std::to_string(row.tally.faults + row.tally.lost) + " of " + std::to_string(row.rays) + " rays");
  for (const ErrorRow& row : record.errors) {
    if (promised(row.subject) && row.errors.beyond_bound != 0)
      broken.push_back(row.subject + ": " + row.name + ": " + std::to_string(row.errors.beyond_bound) +
                       " hit points beyond their bounds");
    if (row.subject == "reference" && (row.errors.missed != 0 || row.errors.other != 0))
      broken.push_back(row.subject + ": " + row.name + ": a hit that differs from the exact one");
  }
  for (const InstancedRow& row : record.spheres)
    if (promised(row.subject) && row.errors.beyond_bound + row.tally.faults + row.tally.lost != 0)
      broken.push_back(row.subject + ": " + row.sphere + ": " + std::to_string(row.errors.beyond_bound) +
                       " hit points beyond their bounds, " + std::to_string(row.tally.faults + row.tally.lost) +
                       " spawned rays");
  return broken;
}

}  // namespace hiprt::bench
