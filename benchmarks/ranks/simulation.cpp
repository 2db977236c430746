#include "simulation.h"

#include "busy_server.h"

#include <tools/render/units/unit_dealer.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <queue>
#include <random>
#include <set>
#include <tuple>

namespace hiprt::bench {
namespace {

using tools::PictureUnit;

enum class Kind { kArrives, kComputed, kReturns };

struct Event {
  double time;
  std::uint64_t number;  ///< Of equal times, the first comes first.
  Kind kind;
  unsigned rank;
  PictureUnit unit;
  double seconds;  ///< Of the computation.

  friend bool operator>(const Event& a, const Event& b) {
    return std::tie(a.time, a.number) > std::tie(b.time, b.number);
  }
};

class Simulation {
 public:
  Simulation(const PictureCosts& picture, const RankCosts& costs, unsigned ranks, unsigned workers, std::uint64_t seed)
      : picture_(picture),
        costs_(costs),
        nothing_(picture.grid.tiles()),
        dealer_(picture.grid, picture.steps, nothing_, ranks),
        workers_(workers),
        idle_(ranks, workers),
        held_(ranks),
        waiting_(ranks),
        random_(seed) {
    for (unsigned rank = 0; rank < ranks; ++rank) dealer_.join(rank, workers);
  }

  SimulatedRun run() {
    for (unsigned rank = 0; rank < idle_.size(); ++rank) hungry_.insert(hungry_.end(), rank);
    deal(0.0);
    while (!dealer_.finished()) {
      const Event event = events_.top();
      events_.pop();
      if (event.kind == Kind::kArrives) arrive(event);
      if (event.kind == Kind::kComputed) compute_next(event);
      if (event.kind == Kind::kReturns) take(event);
    }
    result_.dealing = dealing_.busy();
    result_.messaging = messaging_.busy();
    result_.card = std::max(in_.busy(), out_.busy());
    return result_;
  }

 private:
  double bytes_of(const PictureUnit& unit) const { return static_cast<double>(unit.pixels() * picture_.pixel_bytes); }

  void add(double time, Kind kind, unsigned rank, const PictureUnit& unit, double seconds = 0.0) {
    events_.push({time, next_number_++, kind, rank, unit, seconds});
  }

  /// The dealing thread gives ranks with too few units what there is, the lowest rank first.
  void deal(double time) {
    while (!hungry_.empty()) {
      const unsigned rank = *hungry_.begin();
      const auto unit = dealer_.next(rank);
      if (!unit && held_[rank] < 2 * workers_) return;  // No tile is left.
      if (!unit)
        hungry_.erase(rank);
      else
        time = send(rank, *unit, time);
    }
  }

  /// @return when the dealing thread has done it.
  double send(unsigned rank, const PictureUnit& unit, double time) {
    ++result_.units;
    ++held_[rank];
    // The first unit of a tile is sent without pixels.
    const double bytes = unit.first == 0 ? 0.0 : bytes_of(unit);
    const double own = 0.5 * costs_.unit_seconds + costs_.rank_seconds * static_cast<double>(idle_.size());
    time = dealing_.serve(time, own + costs_.byte_seconds * bytes);
    if (rank == 0) {
      add(time, Kind::kArrives, rank, unit);
      return time;
    }
    result_.bytes += static_cast<std::uint64_t>(bytes);
    const double sent = out_.serve(messaging_.serve(time, costs_.message_seconds), bytes / costs_.byte_per_second);
    add(sent + costs_.latency, Kind::kArrives, rank, unit);
    return time;
  }

  void arrive(const Event& event) {
    waiting_[event.rank].push_back(event.unit);
    start(event.rank, event.time);
  }

  void start(unsigned rank, double time) {
    while (idle_[rank] != 0 && !waiting_[rank].empty()) {
      const PictureUnit unit = waiting_[rank].front();
      waiting_[rank].pop_front();
      --idle_[rank];
      const double seconds = time_of(unit);
      result_.worked += seconds;
      add(time + seconds, Kind::kComputed, rank, unit, seconds);
    }
  }

  void compute_next(const Event& event) {
    ++idle_[event.rank];
    start(event.rank, event.time);
    const double bytes = bytes_of(event.unit);
    double there = event.time;
    if (event.rank != 0) {
      result_.bytes += static_cast<std::uint64_t>(bytes);
      there = messaging_.serve(in_.serve(event.time + costs_.latency, bytes / costs_.byte_per_second),
                               costs_.message_seconds);
      // The thread sleeps in ticks while it has nothing to do.
      if (costs_.tick > 0.0 && dealing_.free() < there) there = std::ceil(there / costs_.tick) * costs_.tick;
    }
    add(there, Kind::kReturns, event.rank, event.unit, event.seconds);
  }

  void take(const Event& event) {
    const double time =
        dealing_.serve(event.time, 0.5 * costs_.unit_seconds + costs_.byte_seconds * bytes_of(event.unit));
    dealer_.take(event.rank, event.unit, event.seconds);
    result_.seconds = time;
    --held_[event.rank];
    hungry_.insert(event.rank);
    deal(time);
  }

  double time_of(const PictureUnit& unit) {
    const std::uint32_t side = picture_.grid.tile, columns = picture_.grid.columns(),
                        first = unit.top / side * columns + unit.left / side;
    double seconds = 0.0;
    for (std::uint32_t x = 0; x * side < unit.width; ++x) seconds += picture_.tile_seconds[first + x] * unit.steps;
    const double spread = picture_.deviation / std::sqrt(static_cast<double>(unit.steps));
    // Its mean is 1.
    return spread == 0.0 ? seconds : seconds * std::exp(spread * normal_(random_) - 0.5 * spread * spread);
  }

  const PictureCosts& picture_;
  const RankCosts& costs_;
  std::vector<std::uint32_t> nothing_;
  tools::UnitDealer dealer_;
  unsigned workers_;
  std::vector<unsigned> idle_;                    ///< Workers of each rank that do nothing.
  std::vector<unsigned> held_;                    ///< Units of each rank whose results are still out.
  std::set<unsigned> hungry_;                     ///< Ranks that may get more.
  std::vector<std::deque<PictureUnit>> waiting_;  ///< Units of each rank that have arrived.
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::uint64_t next_number_ = 0;
  BusyServer dealing_, messaging_, in_, out_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  SimulatedRun result_;
};

}  // namespace

SimulatedRun simulate(const PictureCosts& picture, const RankCosts& costs, unsigned ranks, unsigned workers,
                      std::uint64_t seed) {
  return Simulation(picture, costs, ranks, workers, seed).run();
}

double least_seconds(const SimulatedRun& run, unsigned ranks, unsigned workers) {
  return std::max({run.worked / (static_cast<double>(ranks) * workers), run.dealing, run.messaging, run.card});
}

}  // namespace hiprt::bench
