#include "part_simulation.h"

#include "busy_server.h"
#include "part_worker.h"
#include "rank_cores.h"

#include <tools/render/parts/part_answer.h>
#include <tools/render/units/unit_dealer.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>
#include <set>
#include <utility>

namespace hiprt::bench {
namespace {

using tools::PictureUnit;

class PartSimulation {
 public:
  PartSimulation(const PartPictureCosts& picture, const ExchangeCosts& costs, const PartRun& run)
      : picture_(picture),
        costs_(costs),
        run_(run),
        nothing_(picture.grid.tiles()),
        dealer_(picture.grid, picture.steps, nothing_, run.ranks),
        cores_(
            run.ranks, run.threads,
            [this](TaskKind kind, unsigned rank, std::uint32_t subject) { end(kind, rank, subject); },
            [this](std::uint32_t message) { arrive(message); }),
        in_(run.ranks),
        out_(run.ranks),
        held_(run.ranks),
        units_(run.ranks),
        credit_(std::size_t{run.ranks} * run.ranks, std::floor(run.credit)),
        random_(run.seed),
        slower_(run.ranks == 1 ? 1.0 : 1.0 / (1.0 - costs.waiting / run.threads)),
        per_rank_(run.ranks == 1 ? run.threads : 2 * run.threads),
        workers_(std::size_t{run.ranks} * per_rank_) {
    for (std::size_t i = 0; i < workers_.size(); ++i) workers_[i].rank = static_cast<unsigned>(i / per_rank_);
    for (unsigned rank = 0; rank < run.ranks; ++rank) dealer_.join(rank, per_rank_);
  }

  SimulatedPartRun run() {
    for (unsigned rank = 0; rank < run_.ranks; ++rank) hungry_.insert(hungry_.end(), rank);
    deal();
    while (!dealer_.finished() && cores_.step()) {
    }
    for (unsigned rank = 0; rank < run_.ranks; ++rank) {
      double others = 0.0;
      for (const TaskKind kind : {TaskKind::kMessage, TaskKind::kAnswer}) others += cores_.seconds(rank, kind);
      result_.worked += others + cores_.seconds(rank, TaskKind::kPath);
      result_.busiest = std::max(result_.busiest, others);
      result_.card = std::max({result_.card, in_[rank].busy(), out_[rank].busy()});
    }
    return result_;
  }

 private:
  // Messages.

  void post(std::uint32_t number) {
    Message& message = messages_[number];
    if (message.matter == Matter::kQuestion || message.matter == Matter::kAnswer) {
      ++result_.messages;
      result_.bytes += message.bytes;
      if (message.matter == Matter::kQuestion) result_.sent += message.rays;
    }
    if (message.from == message.to)
      deliver(number);
    else
      cores_.start(TaskKind::kMessage, message.from, wire_seconds(message), number);
  }

  double wire_seconds(const Message& message) const {
    return costs_.message_seconds + costs_.message_byte * message.bytes;
  }

  void arrive(std::uint32_t number) {
    Message& message = messages_[number];
    if (message.from == message.to)
      deliver(number);
    else
      cores_.start(TaskKind::kMessage, message.to, wire_seconds(message), number);
  }

  void end(TaskKind kind, unsigned rank, std::uint32_t subject) {
    if (kind == TaskKind::kPath) return go_on(subject);
    if (kind == TaskKind::kAnswer) return answer(rank, subject);
    Message& message = messages_[subject];
    if (message.there) return deliver(subject);
    message.there = true;
    const double seconds = message.bytes / costs_.byte_per_second;
    const double sent = out_[message.from].serve(cores_.now(), seconds);
    // The receiver's card takes the bytes while they come, unless others come, too.
    cores_.wait_until(in_[message.to].serve(sent + costs_.latency - seconds, seconds), subject);
  }

  void deliver(std::uint32_t number) {
    Message& message = messages_[number];
    switch (message.matter) {
      case Matter::kQuestion:
        cores_.start(TaskKind::kAnswer, message.to,
                     slower_ * (message.seconds + costs_.parcel + costs_.owner_ray * message.rays +
                                costs_.owner_hit * message.hits),
                     number);
        break;
      case Matter::kAnswer: {
        Worker& worker = workers_[message.worker];
        worker.answers.push_back(number);
        if (worker.phase == Phase::kWaiting) proceed(message.worker);
        break;
      }
      case Matter::kUnit:
        units_[message.to].push_back(message.unit);
        messages_.end(number);
        begin_units(message.to);
        break;
      case Matter::kResult:
        take_result(number);
        break;
    }
  }

  void answer(unsigned rank, std::uint32_t number) {
    Message& question = messages_[number];
    question.matter = Matter::kAnswer;
    question.to = question.from;
    question.from = rank;
    question.there = false;
    question.bytes = kAnswerBytes + question.rays +
                     question.hits * static_cast<double>(sizeof(tools::PartHit) + 4 * picture_.levels);
    post(number);
  }

  // The dealer of rank 0.

  void deal() {
    while (!hungry_.empty()) {
      const unsigned rank = *hungry_.begin();
      const auto unit = dealer_.next(rank);
      if (!unit && held_[rank] < 2 * per_rank_) return;  // No tile is left.
      if (!unit) {
        hungry_.erase(rank);
        continue;
      }
      ++held_[rank];
      dealing_.serve(cores_.now(), 0.5 * costs_.unit_seconds);
      const std::uint32_t message = messages_.add(
          Matter::kUnit, 0, rank, unit->first == 0 ? 0.0 : static_cast<double>(unit->pixels() * picture_.pixel_bytes));
      messages_[message].unit = *unit;
      post(message);
    }
  }

  void take_result(std::uint32_t number) {
    const Message& message = messages_[number];
    result_.seconds = dealing_.serve(cores_.now(), 0.5 * costs_.unit_seconds);
    dealer_.take(message.from, message.unit, message.took);
    --held_[message.from];
    hungry_.insert(message.from);
    messages_.end(number);
    deal();
  }

  // Workers.

  std::uint32_t first_worker(unsigned rank) const { return rank * per_rank_; }

  void compute(std::uint32_t number, Phase phase, double seconds) {
    workers_[number].phase = phase;
    cores_.start(TaskKind::kPath, workers_[number].rank, slower_ * seconds, number);
  }

  void begin_units(unsigned rank) {
    for (std::uint32_t i = first_worker(rank); i < first_worker(rank + 1) && !units_[rank].empty(); ++i) {
      Worker& worker = workers_[i];
      if (worker.phase != Phase::kIdle) continue;
      worker.unit = units_[rank].front();
      units_[rank].pop_front();
      worker.began = cores_.now();
      worker.waves = waves_of(picture_, worker.unit, run_.wave_paths);
      worker.wave = worker.call = 0;
      begin_call(i);
    }
  }

  void begin_call(std::uint32_t number) {
    Worker& worker = workers_[number];
    const Wave& wave = worker.waves[worker.wave];
    if (worker.call == wave.calls->calls.size())
      compute(number, Phase::kEnding, wave.times * wave.calls->seconds);
    else
      compute(number, Phase::kBetween, wave.times * worker.now().seconds);
  }

  /// A task of the worker is done.
  void go_on(std::uint32_t number) {
    Worker& worker = workers_[number];
    switch (worker.phase) {
      case Phase::kBetween: {
        const TraceCall& call = worker.now();
        const double times = worker.waves[worker.wave].times;
        result_.rays += times * call.rays;
        // Whole rays: a short wave has no part of a ray to a part that few rays visit.
        for (const RayTours& tours : call.tours)
          if (const double rays = std::floor(times * tours.rays + part_(random_)); rays > 0.0)
            walk(worker, {&tours, 0, rays});
        break;
      }
      case Phase::kSending:
        worker.out += static_cast<unsigned>(worker.leaving.size());
        for (const std::uint32_t message : std::exchange(worker.leaving, {})) post(message);
        break;
      case Phase::kVisiting:
        for (const Walk& walks : std::exchange(worker.visiting, {}))
          walk(worker, {walks.tours, walks.at + 1, walks.rays});
        break;
      case Phase::kTaking:
        take_answers(worker);
        break;
      case Phase::kEnding:
        return end_wave(number);
      default:
        break;
    }
    proceed(number);
  }

  static void walk(Worker& worker, const Walk& walk) {
    if (walk.at < walk.tours->parts.size()) worker.ready[walk.tours->parts[walk.at]].push_back(walk);
  }

  void take_answers(Worker& worker) {
    for (const std::uint32_t number : std::exchange(worker.taken, {})) {
      --worker.out;
      const Message& message = messages_[number];
      credit_of(worker.rank, message.from) += message.rays;
      for (const Walk& walks : message.walks) walk(worker, {walks.tours, walks.at + 1, walks.rays});
      messages_.end(number);
    }
    // Others may wait for this credit.
    for (std::uint32_t i = first_worker(worker.rank); i < first_worker(worker.rank + 1); ++i)
      if (workers_[i].phase == Phase::kWaiting && !workers_[i].ready.empty()) proceed(i);
  }

  double& credit_of(unsigned from, unsigned to) { return credit_[std::size_t{from} * run_.ranks + to]; }

  const PartVisits& visits_of(const Worker& worker, std::uint16_t part) const {
    return *std::ranges::lower_bound(worker.now().visits, part, {}, &PartVisits::part);
  }

  /// What PartExchange::run() does next.
  void proceed(std::uint32_t number) {
    Worker& worker = workers_[number];
    if (const double seconds = pack(number); !worker.leaving.empty()) return compute(number, Phase::kSending, seconds);
    if (const double seconds = visit(worker); !worker.visiting.empty())
      return compute(number, Phase::kVisiting, seconds);
    if (!worker.answers.empty()) {
      worker.taken = std::exchange(worker.answers, {});
      double taking = 0.0;
      for (const std::uint32_t answer : worker.taken)
        taking += 0.5 * costs_.home_ray * messages_[answer].rays + costs_.home_hit * messages_[answer].hits;
      return compute(number, Phase::kTaking, taking);
    }
    if (worker.out != 0 || !worker.ready.empty()) {
      worker.phase = Phase::kWaiting;
      return;
    }
    ++worker.call;
    begin_call(number);
  }

  /// Takes the rays for other ranks that there is credit for. @return the seconds for that.
  double pack(std::uint32_t number) {
    Worker& worker = workers_[number];
    double seconds = 0.0;
    for (auto at = worker.ready.begin(); at != worker.ready.end();) {
      auto& [part, walks] = *at;
      const unsigned owner = run_.owner[part];
      double& credit = credit_of(worker.rank, owner);
      if (owner == worker.rank || credit < 1.0) {
        ++at;
        continue;
      }
      const std::uint32_t to = messages_.add(Matter::kQuestion, worker.rank, owner, 0.0);
      Message& message = messages_[to];
      message.worker = number;
      while (!walks.empty() && credit >= 1.0) {
        Walk& last = walks.back();
        const double rays = std::min(credit, last.rays);
        message.walks.push_back({last.tours, last.at, rays});
        message.rays += rays;
        credit -= rays;
        last.rays -= rays;
        if (last.rays < 1.0) walks.pop_back();
      }
      const PartVisits& visits = visits_of(worker, part);
      message.hits = visits.hits * message.rays;
      message.seconds = visits.seconds * message.rays;
      message.bytes = kQuestionBytes + static_cast<double>(tools::kQuestionRayBytes) * message.rays;
      seconds += 0.5 * costs_.home_ray * message.rays;
      worker.leaving.push_back(to);
      at = walks.empty() ? worker.ready.erase(at) : std::next(at);
    }
    return seconds;
  }

  /// Takes the rays for parts of this rank. @return the seconds of their visits.
  double visit(Worker& worker) const {
    double seconds = 0.0;
    for (auto at = worker.ready.begin(); at != worker.ready.end();) {
      auto& [part, walks] = *at;
      if (run_.owner[part] != worker.rank) {
        ++at;
        continue;
      }
      for (const Walk& walk : walks) seconds += visits_of(worker, part).seconds * walk.rays;
      seconds += costs_.parcel;
      worker.visiting.insert(worker.visiting.end(), walks.begin(), walks.end());
      at = worker.ready.erase(at);
    }
    return seconds;
  }

  void end_wave(std::uint32_t number) {
    Worker& worker = workers_[number];
    worker.call = 0;
    if (++worker.wave < worker.waves.size()) return begin_call(number);
    worker.phase = Phase::kIdle;
    const std::uint32_t message = messages_.add(Matter::kResult, worker.rank, 0,
                                                static_cast<double>(worker.unit.pixels() * picture_.pixel_bytes));
    messages_[message].unit = worker.unit;
    messages_[message].took = cores_.now() - worker.began;
    const unsigned rank = worker.rank;
    post(message);
    begin_units(rank);
  }

  const PartPictureCosts& picture_;
  const ExchangeCosts& costs_;
  const PartRun& run_;
  std::vector<std::uint32_t> nothing_;
  tools::UnitDealer dealer_;
  RankCores cores_;
  BusyServer dealing_;
  std::vector<BusyServer> in_, out_;            ///< Network cards.
  std::vector<unsigned> held_;                  ///< Units of each rank whose results are still out.
  std::set<unsigned> hungry_;                   ///< Ranks that may get more.
  std::vector<std::deque<PictureUnit>> units_;  ///< Of each rank, that have arrived.
  std::vector<double> credit_;                  ///< From each rank to each.
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> part_{0.0, 1.0};
  double slower_;      ///< Cores are, since they also look for messages.
  unsigned per_rank_;  ///< Workers.
  std::vector<Worker> workers_;
  MessagePool messages_;
  SimulatedPartRun result_;
};

}  // namespace

SimulatedPartRun simulate(const PartPictureCosts& picture, const ExchangeCosts& costs, const PartRun& run) {
  return PartSimulation(picture, costs, run).run();
}

double seconds_alone(const PartPictureCosts& picture) {
  double sum = 0.0;
  for (std::uint32_t tile = 0; tile < picture.grid.tiles(); ++tile) {
    const PathCalls& calls = picture.calls[picture.calls_of_tile[tile]];
    double seconds = calls.seconds;
    for (const TraceCall& call : calls.calls) {
      seconds += call.seconds;
      for (const RayTours& tours : call.tours)
        for (const std::uint16_t part : tours.parts)
          seconds += tours.rays * std::ranges::lower_bound(call.visits, part, {}, &PartVisits::part)->seconds;
    }
    sum += seconds * picture.steps * static_cast<double>(picture.grid.unit(tile, 1, 0, 1).pixels()) / calls.paths;
  }
  return sum;
}

double least_seconds(const SimulatedPartRun& simulated, const PartRun& run) {
  const double threads = run.threads;
  return std::max({simulated.worked / (run.ranks * threads), simulated.busiest / threads, simulated.card});
}

}  // namespace hiprt::bench
