#include <tools/cli/ranks/rank_crew.h>

#include <tools/base/bytes.h>
#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/render/units/unit_messages.h>

#include <chrono>
#include <thread>
#include <utility>

namespace hiprt::tools {
namespace {

using std::chrono::milliseconds;

/// How long a signal may take from one rank to another.
constexpr milliseconds kSignalSpread{500};

/// Seconds between two looks for messages. Each worker has a second unit at hand meanwhile.
constexpr double kTick = 0.002;

bool interrupted_soon() {
  const auto end = std::chrono::steady_clock::now() + kSignalSpread;
  while (!interrupted() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(milliseconds(5));
  return interrupted();
}

}  // namespace

RankWatch::RankWatch(Ranks& ranks, bool lossy, std::function<void(const std::string&)> warn, std::string advice)
    : ranks_(ranks),
      lossy_(lossy),
      warn_(std::move(warn)),
      advice_(std::move(advice)),
      gone_(static_cast<std::size_t>(ranks.size())) {}

build::Result<void> RankWatch::lose(int rank, const char* reason) {
  gone_[static_cast<std::size_t>(rank)] = 1;
  const std::string what = ranks_.name(rank) + " " + reason;
  if (lossy_) {
    warn_(what + "; the run goes on without it");
    return {};
  }
  if (interrupted_soon()) return {};
  return fail(build::ErrorCode::kBackend, what + "; " + advice_);
}

build::Result<std::vector<int>> RankWatch::news() {
  std::vector<int> result;
  build::Result<void> good;
  const auto add = [&](int rank, const char* reason) {
    if (!good || is_gone(rank)) return;
    result.push_back(rank);
    good = lose(rank, reason);
  };
  while (const auto message = ranks_.receive(RenderTag::kGone, milliseconds(0))) {
    if (!message->bytes.empty())
      return fail(build::ErrorCode::kBackend,
                  ranks_.name(message->from) + ": " + ByteReader(message->bytes).get_text());
    add(message->from, "was interrupted");
  }
  for (const int rank : ranks_.lost()) add(rank, "was lost");
  if (!good) return tl::unexpected(std::move(good.error()));
  return result;
}

RankCrew::RankCrew(RankWatch& watch, std::vector<unsigned> workers, std::size_t pixel_bytes)
    : watch_(watch), workers_(std::move(workers)), pixel_bytes_(pixel_bytes) {}

void RankCrew::send(unsigned rank, UnitJob job) {
  watch_.ranks().send(static_cast<int>(rank), RenderTag::kJob, encode(job));
}

build::Result<std::vector<CrewEvent>> RankCrew::poll() {
  std::vector<CrewEvent> events;
  while (const auto message = watch_.ranks().receive(RenderTag::kResult, milliseconds(0))) {
    if (watch_.is_gone(message->from)) continue;
    auto result = decode_result(message->bytes, pixel_bytes_);
    if (!result) return fail(result.error().code, watch_.ranks().name(message->from) + ": " + result.error().message);
    if (result->error) result->error->message = watch_.ranks().name(message->from) + ": " + result->error->message;
    events.push_back({static_cast<unsigned>(message->from), std::move(*result)});
  }
  auto gone = watch_.news();
  if (!gone) return tl::unexpected(std::move(gone.error()));
  for (const int rank : *gone) {
    workers_[static_cast<std::size_t>(rank)] = 0;
    events.push_back({static_cast<unsigned>(rank), std::nullopt});
  }
  return events;
}

build::Result<void> compute_for_first_rank(Ranks& ranks, PictureWork& work) {
  UnitPool pool(work);
  while (!ranks.must_stop()) {
    if (interrupted()) return cancelled();
    while (const auto message = ranks.receive(RenderTag::kJob, milliseconds(0))) {
      auto job = decode_job(message->bytes, work.pixel_bytes());
      if (!job) return tl::unexpected(std::move(job.error()));
      pool.add(std::move(*job));
    }
    for (const UnitResult& result : pool.wait(kTick)) ranks.send(0, RenderTag::kResult, encode(result));
  }
  return ranks.health();
}

build::Result<void> end_follower(Ranks& ranks, const build::Result<void>& done) {
  if (auto healthy = ranks.health(); !healthy) return healthy;
  if (done || ranks.must_stop()) return {};
  ByteWriter writer;
  if (done.error().code != build::ErrorCode::kCancelled) writer.add_text(done.error().message);
  ranks.send(0, RenderTag::kGone, std::move(writer.bytes()));
  return {};
}

}  // namespace hiprt::tools
