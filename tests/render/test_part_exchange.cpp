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
