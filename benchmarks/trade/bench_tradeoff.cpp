/// What speed costs in truth: every policy set's speed beside its faults and errors; see --help.

#include "engine.h"
#include "errors.h"
#include "places.h"
#include "record.h"

#include <benchmarks/common/flags.h>
#include <benchmarks/common/program.h>
#include <benchmarks/common/rounds.h>
#include <benchmarks/common/scenes.h>

#include <hiprt_build/file.h>
#include <tests/oracle/meshes.h>
#include <tools/base/interrupt.h>
#include <tools/cli/progress.h>

#include <algorithm>
#include <ctime>
#include <iostream>

namespace hiprt::bench {
namespace {

constexpr int kFailure = 1, kUsage = 2;

constexpr std::string_view kDescription =
    R"(bench_tradeoff: what speed costs in truth, policy set by policy set.

usage: bench_tradeoff [FLAG...]

Measures on one device, in one run, of every policy set, with and without fast-math, and of Embree on a CPU:
speed (closest hits of primary and diffuse rays, in turn, for several rounds); rays from inside closed meshes that leak
out, random or aimed at edges and vertices; hits that boxes hide; spawned rays that meet the triangle that they left;
and against exact arithmetic misses, wrong surfaces and the errors of t, u, v and of the hit point, also of hits
through instances and in motion.
Exit status: 0; 1 when something failed, or the default or the reference policies break a guarantee; 2 for a wrong
command line.

)";

struct NamedQuestion {
  Question question;
  const char* name;
};
constexpr NamedQuestion kAimed[] = {
    {Question::kRandom, "random"}, {Question::kEdge, "edges"}, {Question::kVertex, "vertices"}};
constexpr NamedQuestion kBoxes{Question::kBoxes, "boxes"}, kSpawned{Question::kSpawned, "spawned"};

/// What can be left out. "speed", "errors" and "places" are no questions of single rays.
std::vector<std::string> question_names() {
  return {"speed", "random", "edges", "vertices", "boxes", "spawned", "errors", "places"};
}

struct CommandLine {
  std::string device = "cpu", json, markdown, commit = HIPRT_BENCH_COMMIT;
  unsigned threads = 0, rounds = 7, error_rays = 2000, speed_rays = 1'000'000;
  unsigned aimed_thousands = 1000;
  std::vector<std::string> policies, questions = question_names();
  SceneOptions scenes;
};

std::vector<Flag> make_flags(CommandLine& line) {
  std::vector<Flag> flags = line.scenes.flags();
  const std::vector<Flag> more{
      device_flag("who traces (cpu)", line.device),
      list_flag("policies", "NAME,...", "who is asked, as in the tables (all)", line.policies),
      words_flag("questions", "all", line.questions, question_names()),
      number_flag("aimed", "thousands of rays per question", line.aimed_thousands, 1, 100'000'000),
      number_flag("error-rays", "rays per case that are compared with exact arithmetic", line.error_rays, 10,
                  1'000'000),
      number_flag("speed-rays", "rays of each kind that are timed, about", line.speed_rays, 100, 100'000'000),
      number_flag("rounds", "times that everybody traces", line.rounds, 1, 1000),
      number_flag("threads", "of the CPU; 0: all", line.threads, 0, 4096),
      text_flag("json", "FILE", "writes everything there", line.json),
      text_flag("markdown", "FILE", "writes the tables there too", line.markdown),
      text_flag("commit", "TEXT", "of the sources, for the JSON (when CMake ran)", line.commit)};
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

int fail(const std::string& message, int status) {
  std::cerr << "bench_tradeoff: " << message << "\n";
  return status;
}

/// @return those of the engine that the command line names, or the first name that is none.
tl::expected<std::vector<Subject>, std::string> chosen_subjects(const CommandLine& line, const Engine& engine) {
  if (line.policies.empty()) return engine.subjects();
  std::vector<Subject> chosen;
  for (const std::string& name : line.policies) {
    const auto& all = engine.subjects();
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Subject& subject) { return subject.name == name; });
    if (found == all.end()) return tl::unexpected(name);
    chosen.push_back(*found);
  }
  return chosen;
}

class Session {
 public:
  Session(const CommandLine& line, Engine& engine, std::vector<Subject> subjects) : line_(line), engine_(engine) {
    record_.subjects = std::move(subjects);
  }

  const TradeoffRecord& record() const { return record_; }

  build::Result<void> run() {
    if (wants("speed"))
      if (auto done = measure_speed(); !done) return done;
    if (auto done = ask_models(); !done) return done;
    if (wants("errors"))
      if (auto done = compare(); !done) return done;
    return wants("places") ? look_at_places() : build::Result<void>();
  }

 private:
  build::Result<void> set_model(const Model& model, Trees& trees) {
    auto built = build_trees(model);
    if (!built) return tl::unexpected(built.error());
    trees = std::move(*built);
    return engine_.set_model(model, trees);
  }

  build::Result<void> measure_speed() {
    const auto names = find_scenes(line_.scenes);
    if (!names) return tl::unexpected(names.error());
    for (const std::string& name : *names) {
      bar_.update((name + ": speed").c_str(), 0);
      auto scene = load_scene(line_.scenes, name);
      if (!scene) return tl::unexpected(scene.error());
      auto sets = load_rays(line_.scenes, *scene, line_.speed_rays);
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
    const Timings seconds = run_rounds(contestants, line_.rounds);
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
    return std::find(line_.questions.begin(), line_.questions.end(), name) != line_.questions.end();
  }

  build::Result<void> ask(const Model& model, const NamedQuestion& asked, float tmin = -1.0f,
                          const std::string& origin = {}) {
    const std::uint64_t count = std::uint64_t{line_.aimed_thousands} * 1000;
    for (const Subject& subject : record_.subjects) {
      // Others' boxes cannot be widened, and they have no bound of their errors.
      const bool own = asked.question == Question::kBoxes || (asked.question == Question::kSpawned && tmin < 0.0f);
      if (!subject.ours && own) continue;
      bar_.update((model.name + ": " + asked.name + ": " + subject.name).c_str(), fraction_);
      const auto tally = engine_.ask(subject, {asked.question, tmin, 0.0f, {}}, count);
      if (!tally) return tl::unexpected(tally.error());
      record_.faults.push_back({subject.name, model.name, asked.name, origin, count, *tally});
    }
    return {};
  }

  build::Result<void> ask_aimed(const Model& model) {
    for (const NamedQuestion& asked : kAimed)
      if (wants(asked.name))
        if (auto done = ask(model, asked); !done) return done;
    return {};
  }

  build::Result<void> ask_boxes(const Model& model) {
    return wants(kBoxes.name) ? ask(model, kBoxes) : build::Result<void>();
  }

  build::Result<void> ask_spawned(const Model& model) {
    if (!wants(kSpawned.name)) return {};
    if (auto done = ask(model, kSpawned, -1.0f, "spawn_origin"); !done) return done;
    for (const auto& [tmin, origin] : {std::pair{0.0f, "tmin 0"}, {1e-5f, "tmin 1e-5"}, {1e-3f, "tmin 1e-3"}})
      if (auto done = ask(model, kSpawned, tmin, origin); !done) return done;
    return {};
  }

  build::Result<void> ask_models() {
    const oracle::Mesh star = oracle::star(4, 11), sphere = oracle::icosphere(4),
                       box = oracle::subdivided_box(12, 1.9, 12);
    struct Asked {
      Model model;
      build::Result<void> (Session::*ask)(const Model&);
    };
    const std::vector<Asked> all{
        {make_model("star", star, 0.05), &Session::ask_aimed},
        {make_model("sphere", sphere, 0.5), &Session::ask_aimed},
        {make_model("box", box, 0.9), &Session::ask_aimed},
        // Few triangles: a ray that enters every box tests them all.
        {make_model("box", oracle::subdivided_box(3, 1.9, 3), 0.9), &Session::ask_boxes},
        {make_model("sphere", oracle::icosphere(1), 0.5), &Session::ask_boxes},
        {make_model("sphere", sphere, 0.5), &Session::ask_spawned},
        {make_model("star", star, 0.05), &Session::ask_spawned},
        {make_model("sphere, radius 10 at 1e4", sphere, 0.5, 10, {1e4, 1e4, 1e4}), &Session::ask_spawned}};
    for (const Asked& asked : all) {
      fraction_ += 1.0 / static_cast<double>(all.size());
      Trees trees;
      if (auto set = set_model(asked.model, trees); !set) return set;
      if (auto done = (this->*asked.ask)(asked.model); !done) return done;
    }
    return {};
  }

  build::Result<void> compare() {
    bar_.update("exact hits", 1.0);
    for (const ErrorCase& errors : error_cases(line_.error_rays)) {
      Trees trees;
      if (auto set = set_model(errors.model, trees); !set) return set;
      std::vector<Hit> hits(errors.rays.size());
      for (const Subject& subject : record_.subjects) {
        // Hits do not depend on the layout.
        if (subject.ours && kPolicySets[subject.set].layout != NodeLayout::kPlanes) continue;
        const auto traced = engine_.trace(subject, errors.rays, hits);
        if (!traced) return tl::unexpected(traced.error());
        record_.errors.push_back({subject.name, errors.model.name, measure_errors(errors, hits, subject.ours)});
      }
    }
    return {};
  }

  build::Result<void> look_at_places() {
    auto places = make_places();
    if (!places) return tl::unexpected(places.error());
    for (const Place& place : *places)
      if (auto done = look_at(place); !done) return done;
    return {};
  }

  build::Result<void> look_at(const Place& place) {
    if (auto set = engine_.set_place(place); !set) return set;
    std::vector<std::size_t> asked;
    for (std::size_t i = 0; i < record_.subjects.size(); ++i)
      if (engine_.traces_place(record_.subjects[i])) asked.push_back(i);
    const PlacedRays placed = placed_rays(place, line_.error_rays);
    std::vector<Ray> rays;
    // Of which a CPU needs fewer: through 16 levels they take long.
    const unsigned timed = line_.device == "cpu" ? line_.speed_rays / 10 : line_.speed_rays;
    while (rays.size() < timed) rays.insert(rays.end(), placed.rays.begin(), placed.rays.end());
    bar_.update((place.name + ": speed").c_str(), 1.0);
    const auto seconds = time_each(asked, rays);
    if (!seconds) return tl::unexpected(seconds.error());
    Trees trees;
    if (auto set = set_model(place.model, trees); !set) return set;
    const auto flat_seconds = time_each(asked, rays);
    if (!flat_seconds) return tl::unexpected(flat_seconds.error());
    if (auto set = engine_.set_place(place); !set) return set;
    std::vector<Hit> hits(placed.rays.size());
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const Subject& subject = record_.subjects[asked[k]];
      PlaceRow row{subject.name, place.name, (*flat_seconds)[k] / (*seconds)[k], {}, 0, {}};
      bar_.update((place.name + ": " + subject.name).c_str(), 1.0);
      if (const auto traced = engine_.trace(subject, placed.rays, hits); !traced) return tl::unexpected(traced.error());
      row.errors = measure_placed(place, placed, hits, subject.ours);
      if (subject.ours) {
        row.spawned = std::uint64_t{line_.aimed_thousands} * 1000;
        const auto tally = engine_.ask(subject, {Question::kSpawned, -1.0f, place.time, {}}, row.spawned);
        if (!tally) return tl::unexpected(tally.error());
        row.tally = *tally;
      }
      record_.places.push_back(std::move(row));
    }
    return {};
  }

  /// The median of the seconds that each of some subjects takes.
  build::Result<std::vector<double>> time_each(const std::vector<std::size_t>& subjects, const std::vector<Ray>& rays) {
    std::vector<Hit> hits(rays.size());
    std::vector<std::vector<double>> seconds(subjects.size());
    for (unsigned round = 0; round <= line_.rounds; ++round)
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

  const CommandLine& line_;
  Engine& engine_;
  TradeoffRecord record_;
  tools::ProgressBar bar_;
  double fraction_ = 0.0;  ///< Of the models.
};

/// What is promised of the usual compiler's Conservative sets with Watertight or Reference.
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
        (row.question != "spawned" || row.origin == "spawn_origin"))
      broken.push_back(row.subject + ": " + row.model + ": " + row.question + ": " +
                       std::to_string(row.tally.faults + row.tally.lost) + " of " + std::to_string(row.rays) + " rays");
  for (const ErrorRow& row : record.errors) {
    if (promised(row.subject) && row.errors.beyond_bound != 0)
      broken.push_back(row.subject + ": " + row.name + ": " + std::to_string(row.errors.beyond_bound) +
                       " hit points beyond their bounds");
    if (row.subject == "reference" && (row.errors.missed != 0 || row.errors.other != 0))
      broken.push_back(row.subject + ": " + row.name + ": a hit that is not the exact one");
  }
  for (const PlaceRow& row : record.places)
    if (promised(row.subject) && row.errors.beyond_bound + row.tally.faults + row.tally.lost != 0)
      broken.push_back(row.subject + ": " + row.place + ": " + std::to_string(row.errors.beyond_bound) +
                       " hit points beyond their bounds, " + std::to_string(row.tally.faults + row.tally.lost) +
                       " spawned rays");
  return broken;
}

build::Result<void> write_text(const std::string& path, const std::string& text) {
  if (path.empty()) return {};
  return build::write_file(path, std::as_bytes(std::span(text)));
}

int measure(const CommandLine& line, const std::string& command) {
  for (const std::string& path : {line.json, line.markdown})
    if (const auto can = path.empty() ? build::Result<void>{} : build::check_writable(path); !can)
      return fail(can.error().message, kFailure);
  auto engine = line.device == "cpu" ? make_cpu_engine(line.threads) : make_gpu_engine();
  if (!engine) return fail("--device=" + line.device + ": " + engine.error().message, kFailure);
  auto subjects = chosen_subjects(line, **engine);
  if (!subjects) return fail("--policies: '" + subjects.error() + "' is none of them", kUsage);
  const tools::InterruptGuard guard;
  Session session(line, **engine, std::move(*subjects));
  if (const auto done = session.run(); !done) return fail(done.error().message, kFailure);
  char date[32] = "";
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof(date), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&now));
  const std::vector<std::string> broken = broken_guarantees(session.record());
  nlohmann::json json{
      {"format", kTradeoffFormat},       {"commit", line.commit},       {"command", command},         {"date", date},
      {"device", (*engine)->describe()}, {"compiler", compiler_name()}, {"broken_guarantees", broken}};
  add_json(session.record(), json);
  const std::string text = to_markdown(session.record());
  std::cout << text << std::flush;
  for (const auto& written : {write_text(line.json, json.dump(1) + "\n"), write_text(line.markdown, text)})
    if (!written) return fail(written.error().message, kFailure);
  for (const std::string& fault : broken) std::cerr << "bench_tradeoff: a guarantee is broken: " << fault << "\n";
  return broken.empty() ? 0 : kFailure;
}

}  // namespace
}  // namespace hiprt::bench

int main(int argc, char** argv) {
  using namespace hiprt::bench;
  CommandLine line;
  std::string command;
  for (int i = 0; i < argc; ++i) command += (i == 0 ? "" : " ") + std::string(argv[i]);
  std::vector<Flag> flags = make_flags(line);
  for (int i = 1; i < argc; ++i)
    if (std::string_view(argv[i]) == "--help" || std::string_view(argv[i]) == "-h") {
      std::cout << kDescription << describe(flags);
      return 0;
    }
  if (const std::string fault = take_flags(argc, argv, flags); !fault.empty()) return fail(fault, kUsage);
  if (argc > 1) return fail("unknown argument '" + std::string(argv[1]) + "' (see --help)", kUsage);
  return measure(line, command);
}
