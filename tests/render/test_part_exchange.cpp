/// The exchange of rays between processes: it ends, and finds the same, in every order of messages and with the least
/// memory.

#include "part_scenes.h"

#include <tests/amount.h>
#include <tools/render/parts/part_work.h>
#include <tools/render/path/cpu_path_engine.h>
#include <tools/render/units/path_work.h>
#include <tools/render/units/picture_state.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <thread>

using namespace hiprt;
using namespace hiprt::test;
using namespace hiprt::tools;
using std::chrono::milliseconds;

namespace {

const Camera kCamera{{1.0, 2.0, 7.0}, {0, 0, 0}, {0, 1, 0}, 50};
const PathOptions kOptions{.width = 24, .height = 16, .samples = 2, .bounces = 4};

/// Messages between processes of this test. Each arrives after a random time, those to a rank and tag in any order.
class Post {
 public:
  Post(unsigned ranks, std::uint64_t seed) : random_(seed), questions_(ranks), answers_(ranks) {}

  void put(std::deque<RayMail::Letter>& box, RayMail::Letter letter) {
    const std::lock_guard lock(mutex_);
    box.insert(box.begin() + random_.below(static_cast<std::uint32_t>(box.size()) + 1), std::move(letter));
    changed_.notify_all();
  }
  std::optional<RayMail::Letter> take(std::deque<RayMail::Letter>& box, milliseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return !box.empty(); });
    if (box.empty()) return std::nullopt;
    RayMail::Letter letter = std::move(box.front());
    box.pop_front();
    return letter;
  }
  std::deque<RayMail::Letter>& questions(unsigned rank) { return questions_[rank]; }
  std::deque<RayMail::Letter>& answers(unsigned rank, unsigned slot) {
    const std::lock_guard lock(mutex_);
    return answers_[rank][slot];
  }
  void lose(unsigned rank) {
    const std::lock_guard lock(mutex_);
    lost_ = rank;
    changed_.notify_all();
  }
  std::optional<unsigned> lost() {
    const std::lock_guard lock(mutex_);
    return lost_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  oracle::Random random_;
  std::vector<std::deque<RayMail::Letter>> questions_;
  std::vector<std::map<unsigned, std::deque<RayMail::Letter>>> answers_;
  std::optional<unsigned> lost_;
};

class PostMail : public RayMail {
 public:
  PostMail(Post& post, unsigned rank, unsigned ranks) : post_(post), rank_(rank), ranks_(ranks) {}

  unsigned rank() const override { return rank_; }
  unsigned ranks() const override { return ranks_; }
  void ask(unsigned rank, std::vector<std::byte> question) override {
    if (damage) question.resize(question.size() - 1);
    post_.put(post_.questions(rank), {rank_, std::move(question)});
  }
  void answer(unsigned rank, unsigned slot, std::vector<std::byte> answer) override {
    if (silent) return;
    if (damage_answers) answer[4] = std::byte{77};
    post_.put(post_.answers(rank, slot), {rank_, std::move(answer)});
  }
  std::optional<Letter> next_question(milliseconds timeout) override {
    return post_.take(post_.questions(rank_), timeout);
  }
  std::optional<Letter> next_answer(unsigned slot, milliseconds timeout) override {
    return post_.take(post_.answers(rank_, slot), timeout);
  }
  build::Result<void> health() const override {
    if (const auto lost = post_.lost())
      return tl::unexpected(build::Error{build::ErrorCode::kBackend, "rank " + std::to_string(*lost) + " was lost"});
    return {};
  }

  bool damage = false, damage_answers = false;
  std::atomic<bool> silent = false;

 private:
  Post& post_;
  unsigned rank_, ranks_;
};

/// All processes of a run.
struct Run {
  Run(const PartedScene& parts, unsigned ranks, std::size_t credit, std::uint64_t seed)
      : post(ranks, seed), settings(settings_of(kOptions, kCamera)) {
    for (unsigned rank = 0; rank < ranks; ++rank) {
      mails.push_back(std::make_unique<PostMail>(post, rank, ranks));
      processes.push_back(std::make_unique<PartProcess>(parts, settings, mails.back().get(), credit));
    }
  }

  Post post;
  PathSettings settings;
  std::vector<std::unique_ptr<PostMail>> mails;
  std::vector<std::unique_ptr<PartProcess>> processes;
};

/// Renders a share of the picture's tiles on every process with several threads.
/// @return the first error, or nothing.
std::optional<build::Error> render(Run& run, unsigned threads, std::size_t paths, PictureState& state) {
  std::mutex mutex;
  std::optional<build::Error> error;
  std::atomic<std::uint32_t> next = 0;
  std::vector<std::unique_ptr<PartWork>> works;
  for (const auto& process : run.processes)
    works.push_back(
        std::make_unique<PartWork>(process->scene(), process->exchange(), kOptions.samples, threads, paths));
  {
    std::vector<std::jthread> pool;
    for (std::size_t i = 0; i < works.size() * threads; ++i)
      pool.emplace_back([&, i] {
        for (std::uint32_t tile = next++; tile < state.grid.tiles(); tile = next++) {
          const PictureUnit unit = state.grid.unit(tile, 1, 0, kOptions.samples);
          std::vector<std::byte> part(unit.pixels() * state.pixel_bytes);
          auto done = works[i % works.size()]->run(unit, part);
          const std::lock_guard lock(mutex);
          if (done)
            state.paste(unit, part);
          else if (!error)
            error = done.error();
          if (done) state.rays += *done;
        }
      });
  }
  return error;
}

}  // namespace

TEST_CASE("exchange: any number of processes, threads, waves and credit give the picture of the whole scene") {
  const std::uint64_t seed = 11;
  const PathSettings settings = settings_of(kOptions, kCamera);
  const WholeScene whole(seed, {}, true, settings);
  const auto expected = trace_paths(whole.scene().view, whole.data(), kCamera, kOptions);
  REQUIRE(expected.has_value());
  const PartedScene parts(seed, {}, true, 5);
  for (const unsigned ranks : {1u, 2u, 3u, 5u, 7u})
    for (const std::size_t credit : {1u, 3u, 10000u}) {
      // Single rays are many messages.
      if (credit == 1 && ranks != 2) continue;
      CAPTURE(ranks, credit);
      Run run(parts, ranks, credit, seed + ranks);
      PictureState state({kOptions.width, kOptions.height, 8}, sizeof(PathSum));
      const auto error = render(run, 2, credit == 1 ? 7 : 128, state);
      INFO((error ? error->message : std::string()));
      REQUIRE(!error);
      PathPicture found = *expected;
      found.sums = picture_of(state.pixels, kOptions.samples, 1).sums;
      CHECK(same_sums(*expected, found));
      CHECK((ranks == 1) == (state.rays.sent == 0));
      CHECK(state.rays.bytes >= state.rays.sent * kQuestionRayBytes);
      // As many answers as questions.
      CHECK(state.rays.messages % 2 == 0);
    }
}

TEST_CASE("exchange: a lost process, a silent one, and damaged messages end it with an error soon") {
  const std::uint64_t seed = 11;
  const PartedScene parts(seed, {}, true, 3);
  const auto ends = [&](const char* name, const std::function<void(Run&)>& prepare, const std::string& word) {
    CAPTURE(name);
    Run run(parts, 3, 100, seed);
    prepare(run);
    PictureState state({kOptions.width, kOptions.height, 8}, sizeof(PathSum));
    const auto begin = std::chrono::steady_clock::now();
    const auto error = render(run, 1, 64, state);
    REQUIRE(error);
    CHECK(error->message.find(word) != std::string::npos);
    CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(20));
  };
  ends(
      "lost",
      [](Run& run) {
        run.post.lose(1);
        run.mails[1]->silent = true;
      },
      "rank 1 was lost");
  ends(
      "question", [](Run& run) { run.mails[0]->damage = true; }, "a question of a part is malformed");
  ends(
      "answer", [](Run& run) { run.mails[2]->damage_answers = true; }, "an answer of a part is malformed");
}

TEST_CASE("exchange: a wave that waits for a silent process ends when it is stopped") {
  const PartedScene parts(11, {}, false, 2);
  Run run(parts, 2, 100, 1);
  run.mails[1]->silent = true;
  PartWork work(run.processes[0]->scene(), run.processes[0]->exchange(), kOptions.samples, 1, 1000);
  std::jthread stopper([&] {
    std::this_thread::sleep_for(milliseconds(200));
    work.stop();
  });
  const PictureUnit unit{0, 0, 24, 16, 0, 1};
  std::vector<std::byte> state(unit.pixels() * sizeof(PathSum));
  const auto done = work.run(unit, state);
  REQUIRE(!done.has_value());
  CHECK(done.error().code == build::ErrorCode::kCancelled);
}

namespace {

/// A run as a value: processes with a wave of rays each, and all messages on their way.
struct Model {
  struct Message {
    unsigned from, to;
    bool is_answer;
    RayTour::Parcel parcel;
    PartAnswer answer;
  };

  std::vector<RayTour> tours;  ///< Of each process.
  std::vector<std::vector<std::size_t>> credit;
  std::vector<Message> messages;  ///< On their way, or waiting at a process.
};

/// Explores all orders of steps from a state. Copies of tours share the arrays of hits, so a state is a list of steps
/// that is run from the start.
class Explorer {
 public:
  /// @param rays of each process.
  Explorer(const std::vector<ScenePart>& parts, std::vector<std::vector<Ray>> rays, std::size_t credit, Query query)
      : parts_(parts),
        router_(parts_),
        rays_(std::move(rays)),
        processes_(static_cast<unsigned>(rays_.size())),
        credit_(credit),
        query_(query) {}

  void run() {
    std::vector<unsigned> choices;
    explore(choices);
  }
  std::size_t ends() const { return ends_; }
  std::size_t states() const { return states_; }

 private:
  struct Wave {
    std::vector<Hit> hits;
    std::vector<std::uint32_t> paths;
    std::vector<PathSurface> surfaces;
  };

  /// Part k has a hit for every ray at t = k + 2, but only for rays to the right of x = 0.
  static PartAnswer answer_of(std::uint32_t part, const RayTour::Parcel& parcel, Query query) {
    PartAnswer answer;
    answer.query = query;
    for (const Ray& ray : parcel.rays) {
      const float t = 2.0f + static_cast<float>(part);
      const bool hits = ray.origin.x > 0.0f && t <= ray.tmax;
      answer.results.push_back(hits ? VisitResult::kHit : VisitResult::kMiss);
      if (!hits || query == Query::kAny) continue;
      PartHit& hit = answer.hits.emplace_back();
      hit.hit.t = t;
      hit.hit.geometry = 0;
      hit.hit.primitive = part;
      answer.paths.push_back(part);
    }
    return answer;
  }

  /// Runs the steps of @p choices. @return how many steps may follow.
  std::size_t replay(const std::vector<unsigned>& choices, std::string& state) {
    std::vector<Wave> waves(processes_);
    Model model;
    model.credit.assign(processes_, std::vector<std::size_t>(processes_, credit_));
    for (unsigned p = 0; p < processes_; ++p) {
      const std::size_t count = rays_[p].size();
      waves[p] = {std::vector<Hit>(count), std::vector<std::uint32_t>(count, kInvalidId),
                  std::vector<PathSurface>(count)};
      model.tours.emplace_back(router_, query_, rays_[p],
                               TourHits{waves[p].hits.data(), waves[p].paths.data(), waves[p].surfaces.data(), 1});
    }
    for (const unsigned choice : choices) step(model, choice);
    state.clear();
    for (unsigned p = 0; p < processes_; ++p) {
      for (const Hit& hit : waves[p].hits) state += std::to_string(hit.primitive) + ",";
      for (std::uint32_t part = 0; part < parts_.size(); ++part)
        state += std::to_string(model.tours[p].ready(part)) + ";";
      for (const std::size_t free : model.credit[p]) state += std::to_string(free) + ":";
    }
    std::vector<std::string> on_way;
    for (const Model::Message& m : model.messages) {
      std::string text = std::to_string(m.from) + (m.is_answer ? "a" : "q") + std::to_string(m.parcel.part);
      for (const std::uint32_t ray : m.parcel.numbers) text += "." + std::to_string(ray);
      on_way.push_back(text);
    }
    std::sort(on_way.begin(), on_way.end());
    for (const std::string& text : on_way) state += "|" + text;
    const std::size_t next = enabled(model).size();
    if (next != 0) return next;
    // Nothing can happen: then everything must be done, and right.
    for (unsigned p = 0; p < processes_; ++p) {
      REQUIRE(model.tours[p].done());
      for (std::size_t i = 0; i < rays_[p].size(); ++i) {
        const bool hits = rays_[p][i].origin.x > 0.0f;
        REQUIRE(waves[p].hits[i].found() == hits);
        if (hits && query_ == Query::kClosest) {
          REQUIRE(waves[p].hits[i].t == 2.0f);
          REQUIRE(waves[p].paths[i] == 0);
        }
      }
      for (const std::size_t free : model.credit[p]) REQUIRE(free == credit_);
    }
    return 0;
  }

  /// The steps that may come next: (process, part) sends, or a message arrives.
  std::vector<std::pair<unsigned, unsigned>> enabled(const Model& model) const {
    std::vector<std::pair<unsigned, unsigned>> steps;
    for (unsigned p = 0; p < processes_; ++p)
      for (unsigned part = 0; part < parts_.size(); ++part)
        if (model.tours[p].ready(part) != 0 && (owner(part) == p || model.credit[p][owner(part)] != 0))
          steps.emplace_back(p, part);
    for (unsigned m = 0; m < model.messages.size(); ++m) steps.emplace_back(processes_, m);
    return steps;
  }
  unsigned owner(unsigned part) const { return part % processes_; }

  void step(Model& model, unsigned choice) const {
    const auto [p, what] = enabled(model)[choice];
    if (p < processes_) {
      const bool own = owner(what) == p;
      const std::size_t ready = model.tours[p].ready(what);
      const std::size_t most = own ? ready : std::min(ready, model.credit[p][owner(what)]);
      RayTour::Parcel parcel = model.tours[p].take(what, most);
      REQUIRE(parcel.numbers.size() == most);
      if (own) {
        REQUIRE(model.tours[p].give(parcel, answer_of(what, parcel, query_)));
        return;
      }
      model.credit[p][owner(what)] -= most;
      model.messages.push_back({p, owner(what), false, std::move(parcel), {}});
      std::size_t held = 0;
      for (const Model::Message& m : model.messages) held += m.to == owner(what) ? m.parcel.numbers.size() : 0;
      // What a process may have to hold: the rays of all others, and the answers to its own.
      REQUIRE(held <= 2 * (processes_ - 1) * credit_);
      return;
    }
    Model::Message message = std::move(model.messages[what]);
    model.messages.erase(model.messages.begin() + what);
    if (message.is_answer) {
      REQUIRE(model.tours[message.to].give(message.parcel, message.answer));
      model.credit[message.to][message.from] += message.parcel.numbers.size();
      return;
    }
    message.answer = answer_of(message.parcel.part, message.parcel, query_);
    message.is_answer = true;
    std::swap(message.from, message.to);
    model.messages.push_back(std::move(message));
  }

  void explore(std::vector<unsigned>& choices) {
    std::string state;
    const std::size_t next = replay(choices, state);
    if (!known_.insert(state).second) return;
    ++states_;
    if (next == 0) ++ends_;
    for (unsigned choice = 0; choice < next; ++choice) {
      choices.push_back(choice);
      explore(choices);
      choices.pop_back();
    }
  }

  std::vector<ScenePart> parts_;
  PartRouter router_;
  std::vector<std::vector<Ray>> rays_;
  unsigned processes_;
  std::size_t credit_;
  Query query_;
  std::set<std::string> known_;
  std::size_t ends_ = 0, states_ = 0;
};

}  // namespace

TEST_CASE("exchange: a ray that a part could not trace has failed, and visits no other part") {
  std::vector<ScenePart> parts(2);
  for (ScenePart& part : parts) {
    part.bounds = {{-1, -1, 1}, {1, 1, 2}};
    part.boxes = {part.bounds};
  }
  const PartRouter router(parts);
  Ray ray;
  ray.direction = Vec3(0, 0, 1);
  for (const Query query : {Query::kClosest, Query::kAny}) {
    Hit hit;
    std::uint32_t path = kInvalidId;
    PathSurface surface;
    RayTour tour(router, query, {&ray, 1}, {&hit, &path, &surface, 1});
    REQUIRE(tour.ready(0) == 1);
    const RayTour::Parcel parcel = tour.take(0, 1);
    PartAnswer answer;
    answer.query = query;
    // Answers of another number of rays or another query change nothing.
    CHECK_FALSE(tour.give(parcel, answer));
    answer.results = {VisitResult::kFailed};
    answer.query = query == Query::kAny ? Query::kClosest : Query::kAny;
    CHECK_FALSE(tour.give(parcel, answer));
    answer.query = query;
    CHECK(tour.give(parcel, answer));
    CHECK(tour.done());
    CHECK(hit.failed());
    CHECK_FALSE(hit.found());
  }
}

TEST_CASE("exchange: every order of the messages of a small run ends with the right hits, and no deadlock") {
  // Parts one behind the other in the rays' direction.
  std::vector<ScenePart> parts(3);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const auto z = 1.5f + static_cast<float>(k);
    parts[k].bounds = {{-10, -10, z}, {10, 10, z + 1.0f}};
    parts[k].boxes = {parts[k].bounds};
  }
  const auto ray = [](float x) {
    Ray result;
    result.origin = Vec3(x, 0, 0);
    result.direction = Vec3(0, 0, 1);
    return result;
  };
  std::size_t states = 0;
  const auto explore = [&](Query query, std::size_t credit, unsigned processes, unsigned rays) {
    CAPTURE(static_cast<int>(query), credit, processes, rays);
    std::vector<std::vector<Ray>> waves(processes);
    for (unsigned p = 0; p < processes; ++p)
      for (unsigned i = 0; i < rays; ++i) waves[p].push_back(ray(i == p % rays ? 1.0f : -1.0f));
    Explorer explorer(parts, waves, credit, query);
    explorer.run();
    CHECK(explorer.ends() == 1);
    states += explorer.states();
  };
  for (const Query query : {Query::kClosest, Query::kAny})
    for (const std::size_t credit : {1u, 2u}) {
      for (const unsigned rays : {1u, 2u, 3u}) explore(query, credit, 2, rays);
      explore(query, credit, 3, 1);
      if (checks::kWorkDivisor < 25) explore(query, credit, 3, 2);
    }
  std::printf("all orders of messages: %zu states\n", states);
}
