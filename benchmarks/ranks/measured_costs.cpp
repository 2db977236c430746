#include "measured_costs.h"

#include <benchmarks/common/rounds.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/render/units/path_work.h>
#include <tools/render/units/unit_dealer.h>
#include <tools/render/units/unit_messages.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

namespace hiprt::bench {
namespace {

using tools::PictureGrid, tools::PictureState, tools::PictureUnit, tools::UnitDealer;

double seconds_of(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Seconds of this thread's processor that @p work takes.
template <class Work> double processor_seconds_of(const Work& work) {
  const double begin = processor_seconds();
  work();
  return processor_seconds() - begin;
}

/// Seconds of the process's other threads.
double seconds_of_others() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID) - processor_seconds(); }

/// Seconds of each round of each tile. @param work of one step.
build::Result<std::vector<std::vector<double>>> time_tiles(tools::PathWork& work, const PictureGrid& grid,
                                                           unsigned rounds) {
  std::vector<std::vector<double>> seconds(grid.tiles());
  for (unsigned round = 0; round < rounds; ++round)
    for (std::uint32_t tile = 0; tile < grid.tiles(); ++tile) {
      if (tools::interrupted()) return tools::cancelled();
      const PictureUnit unit = grid.unit(tile, 1, round, 1);
      std::vector<std::byte> state(unit.pixels() * work.pixel_bytes());
      build::Result<tools::RayCounts> rays;
      const double took = processor_seconds_of([&] { rays = work.run(unit, state); });
      if (!rays) return tl::unexpected(rays.error());
      seconds[tile].push_back(took);
    }
  return seconds;
}

/// The standard deviation, over all rounds, of the logarithm of a time relative to its tile's mean.
double deviation_of(const std::vector<std::vector<double>>& seconds) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const std::vector<double>& tile : seconds) {
    std::vector<double> logs;
    for (const double x : tile) logs.push_back(std::log(x));
    const double mean = std::accumulate(logs.begin(), logs.end(), 0.0) / static_cast<double>(logs.size());
    for (const double x : logs) sum += (x - mean) * (x - mean);
    count += logs.size() - 1;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

/// What the dealing thread does for one unit of a picture, and what a rank does with it, which takes no time.
struct Dealing {
  PictureState state;
  UnitDealer dealer;
  double seconds = 0.0;
  std::uint64_t units = 0;

  Dealing(const PictureGrid& grid, std::size_t pixel_bytes, std::uint32_t steps, unsigned ranks)
      : state(grid, pixel_bytes), dealer(grid, steps, state.done, ranks) {
    for (unsigned rank = 0; rank < ranks; ++rank) dealer.join(rank, 1);
  }

  void deal_one(unsigned rank) {
    std::optional<PictureUnit> unit;
    std::vector<std::byte> message;
    seconds += processor_seconds_of([&] {
      unit = dealer.next(rank);
      if (unit) message = encode(tools::UnitJob{*unit, state.cut(*unit)});
    });
    if (!unit) return;
    ++units;
    auto job = tools::decode_job(message, state.pixel_bytes);
    // As long as a unit of the real run, so that the dealer chooses units of one step.
    const std::vector<std::byte> result = encode(tools::UnitResult{std::move(*job), {}, 0.5, {}});
    seconds += processor_seconds_of([&] {
      const auto taken = tools::decode_result(result, state.pixel_bytes);
      dealer.take(rank, *unit, taken->seconds);
      state.paste(*unit, taken->job.state);
      state.advance(*unit);
    });
  }
};

/// @return the dealing thread's seconds per unit with tiles of a side: the least of several rounds.
double seconds_per_unit(std::uint32_t side, std::size_t pixel_bytes, unsigned ranks) {
  constexpr std::uint32_t kTiles = 64, kSteps = 32;
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 5; ++round) {
    Dealing dealing({side * kTiles, side * kTiles, side}, pixel_bytes, kSteps, ranks);
    for (unsigned i = 0; i < 2 * kTiles * kTiles; ++i) dealing.deal_one(i % ranks);
    least = std::min(least, dealing.seconds / static_cast<double>(std::max<std::uint64_t>(1, dealing.units)));
  }
  return least;
}

}  // namespace

build::Result<PictureCosts> measure_picture(const SceneFile& file, const tools::Camera& camera,
                                            const MeasuredPicture& picture) {
  tools::PathOptions options;
  options.width = picture.width;
  options.height = picture.height;
  options.samples = picture.rounds;
  options.threads = 1;
  constexpr std::uint32_t kSky = 64;
  auto sky = tools::make_sky([](const Vec3& direction) { return Vec3(0.75f + 0.25f * direction.y); }, kSky);
  const auto data = tools::make_path_data(file.view(), nullptr, std::move(sky), std::vector<Vec3>(kSky), 0.0f);
  if (!data) return tl::unexpected(data.error());
  const SceneView scene = file.scene();
  tools::PathWork work(scene, *data, camera, options, nullptr);
  if (auto entered = work.enter(); !entered) return tl::unexpected(entered.error());
  PictureCosts costs{tools::choose_grid(picture.width, picture.height, 16), 1, work.pixel_bytes(), {}, 0.0};
  const auto seconds = time_tiles(work, costs.grid, picture.rounds);
  if (!seconds) return tl::unexpected(seconds.error());
  for (const std::vector<double>& tile : *seconds) costs.tile_seconds.push_back(median(tile));
  costs.deviation = deviation_of(*seconds);
  return costs;
}

std::uint32_t tile_of_view(const PictureGrid& grid, std::uint32_t tile, const PictureGrid& other) {
  const PictureUnit unit = grid.unit(tile, 1, 0, 1);
  const auto place = [](std::uint32_t at, std::uint32_t size, std::uint32_t to) {
    return static_cast<std::uint32_t>(std::uint64_t{at} * to / size);
  };
  const std::uint32_t x = place(unit.left + unit.width / 2, grid.width, other.width) / other.tile,
                      y = place(unit.top + unit.height / 2, grid.height, other.height) / other.tile;
  return y * other.columns() + x;
}

PictureCosts enlarged(const PictureCosts& measured, std::uint32_t width, std::uint32_t height, std::uint32_t steps,
                      unsigned workers) {
  PictureCosts costs{tools::choose_grid(width, height, workers), steps, measured.pixel_bytes, {}, measured.deviation};
  const PictureGrid& from = measured.grid;
  for (std::uint32_t tile = 0; tile < costs.grid.tiles(); ++tile) {
    const std::uint32_t there = tile_of_view(costs.grid, tile, from);
    costs.tile_seconds.push_back(measured.tile_seconds[there] *
                                 static_cast<double>(costs.grid.unit(tile, 1, 0, 1).pixels()) /
                                 static_cast<double>(from.unit(there, 1, 0, 1).pixels()));
  }
  return costs;
}

RankCosts measure_dealing(std::size_t pixel_bytes) {
  constexpr std::uint32_t kSmall = 8, kLarge = 32;
  constexpr unsigned kManyRanks = 1000;
  const double small = seconds_per_unit(kSmall, pixel_bytes, 2), large = seconds_per_unit(kLarge, pixel_bytes, 2),
               many = seconds_per_unit(kSmall, pixel_bytes, kManyRanks);
  // Most tiles are on their way for the second time or later, so their states go both ways.
  const double more_bytes = 2.0 * static_cast<double>((kLarge * kLarge - kSmall * kSmall) * pixel_bytes);
  RankCosts costs;
  costs.byte_seconds = std::max(0.0, large - small) / more_bytes;
  costs.rank_seconds = std::max(0.0, many - small) / (kManyRanks - 2);
  costs.unit_seconds = std::max(0.0, small - 2.0 * costs.rank_seconds -
                                         2.0 * costs.byte_seconds * static_cast<double>(kSmall * kSmall * pixel_bytes));
  return costs;
}

namespace {

using namespace std::chrono_literals;

constexpr int kThere = 1, kBack = 2;

/// A message of another rank. @return kBackend if none comes.
build::Result<tools::RankMessage> receive(tools::Ranks& ranks, int tag) {
  if (auto message = ranks.receive(tag, 10s)) return std::move(*message);
  if (auto healthy = ranks.health(); !healthy) return tl::unexpected(healthy.error());
  return tools::fail(build::ErrorCode::kBackend, "a message between ranks 0 and 1 did not come in 10 seconds");
}

}  // namespace

build::Result<double> measure_messages(tools::Ranks& ranks, std::size_t bytes) {
  constexpr int kRounds = 5, kMessages = 5000;
  const auto message = std::make_shared<const std::vector<std::byte>>(bytes);
  std::vector<double> seconds;
  for (int round = 0; round < kRounds && ranks.rank() <= 1; ++round) {
    const double before = seconds_of_others();
    const bool is_first = ranks.is_first();
    for (int i = 0; is_first && i < kMessages; ++i) ranks.send(1, kThere, message);
    for (int i = 0; i < kMessages; ++i) {
      if (auto received = receive(ranks, is_first ? kBack : kThere); !received)
        return tl::unexpected(std::move(received.error()));
      if (!is_first) ranks.send(0, kBack, message);
    }
    seconds.push_back((seconds_of_others() - before) / (2.0 * kMessages));
  }
  return ranks.is_first() ? median(seconds) : 0.0;
}

build::Result<SingleMessage> measure_single_messages(tools::Ranks& ranks) {
  constexpr int kMessages = 2000, kNothing = 3;
  std::vector<double> seconds;
  double begin = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
  constexpr auto kQuiet = 500ms;
  static_cast<void>(ranks.receive(kNothing, kQuiet));
  const double waiting = (seconds_of(CLOCK_PROCESS_CPUTIME_ID) - begin) / std::chrono::duration<double>(kQuiet).count();
  begin = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
  const double began = seconds_of(CLOCK_MONOTONIC);
  for (int i = 0; i < kMessages && ranks.rank() <= 1; ++i) {
    const double before = seconds_of(CLOCK_MONOTONIC);
    if (ranks.is_first()) ranks.send(1, kThere, std::vector<std::byte>(64));
    if (auto received = receive(ranks, ranks.is_first() ? kBack : kThere); !received)
      return tl::unexpected(std::move(received.error()));
    if (!ranks.is_first()) ranks.send(0, kBack, std::vector<std::byte>(64));
    seconds.push_back(0.5 * (seconds_of(CLOCK_MONOTONIC) - before));
  }
  if (!ranks.is_first()) return SingleMessage{};
  const double looking = waiting * (seconds_of(CLOCK_MONOTONIC) - began);
  const double all = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - begin;
  return SingleMessage{median(seconds), std::max(0.0, all - looking) / (2.0 * kMessages), waiting};
}

double processor_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }

}  // namespace hiprt::bench
