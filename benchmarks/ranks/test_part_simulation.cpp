// Runs of scenes in parts on ranks that do not exist: what must hold whatever the machine.

#include "part_simulation.h"
#include "rank_cores.h"
#include "visit_costs.h"

#include <tests/catch.h>

#include <numeric>
#include <random>

namespace {

using namespace hiprt;
using namespace hiprt::bench;

/// A picture of 64 tiles. Each path has one call, with 1 ms for 1000 rays at home and 2 ms for 1000 visits, and visits
/// each of @p parts parts with the same probability.
PartPictureCosts picture(std::uint16_t parts, std::uint32_t steps = 4) {
  PartPictureCosts costs;
  costs.grid = {256, 256, 32};
  costs.steps = steps;
  PathCalls calls{1024.0, {}, 0.0};
  TraceCall call{1e-6 * 1024.0, 1024.0, {}, {}};
  for (std::uint16_t part = 0; part < parts; ++part) {
    call.tours.push_back({{part}, 1024.0 / parts});
    call.visits.push_back({part, 2e-6, 0.5});
  }
  calls.calls.push_back(call);
  costs.calls.push_back(calls);
  costs.calls_of_tile.assign(costs.grid.tiles(), 0);
  return costs;
}

double paths_of(const PartPictureCosts& costs) {
  return static_cast<double>(costs.grid.width) * costs.grid.height * costs.steps;
}

std::vector<unsigned> one_each(std::uint16_t parts) {
  std::vector<unsigned> owner(parts);
  std::iota(owner.begin(), owner.end(), 0u);
  return owner;
}

/// A picture whose calls and tours are random.
PartPictureCosts random_picture(std::uint64_t seed, std::uint16_t parts) {
  std::mt19937_64 random(seed);
  const auto up_to = [&](unsigned most) { return std::uniform_int_distribution<unsigned>(0, most)(random); };
  PartPictureCosts costs = picture(parts, 3);
  costs.calls.clear();
  for (std::uint32_t tile = 0; tile < costs.grid.tiles(); ++tile) {
    costs.calls_of_tile[tile] = tile;
    PathCalls calls{1024.0, {}, 1e-4};
    for (unsigned left = up_to(4); left != 0; --left) {
      TraceCall call{1e-6 * up_to(2000), 1.0 + up_to(1000), {}, {}};
      for (std::uint16_t part = 0; part < parts; ++part) call.visits.push_back({part, 1e-7 * up_to(40), 0.1});
      for (unsigned classes = up_to(5); classes != 0; --classes) {
        RayTours tours{{}, 1.0 + up_to(200)};
        for (std::uint16_t part = 0; part < parts; ++part)
          if (up_to(1) == 1) tours.parts.push_back(part);
        if (!tours.parts.empty()) call.tours.push_back(tours);
      }
      calls.calls.push_back(call);
    }
    costs.calls.push_back(calls);
  }
  return costs;
}

/// Visits of all paths of the picture to parts.
double visits_of(const PartPictureCosts& costs) {
  double sum = 0.0;
  for (std::uint32_t tile = 0; tile < costs.grid.tiles(); ++tile) {
    const PathCalls& calls = costs.calls[costs.calls_of_tile[tile]];
    const double paths = static_cast<double>(costs.grid.unit(tile, 1, 0, 1).pixels()) * costs.steps;
    for (const TraceCall& call : calls.calls)
      for (const RayTours& tours : call.tours)
        sum += static_cast<double>(tours.parts.size()) * tours.rays * paths / calls.paths;
  }
  return sum;
}

}  // namespace

TEST_CASE("cores work on urgent tasks first, and the others give way and lose no time") {
  std::vector<std::pair<std::uint32_t, double>> done;
  RankCores* at = nullptr;
  RankCores cores(
      1, 1, [&](TaskKind, unsigned, std::uint32_t subject) { done.emplace_back(subject, at->now()); },
      [&](std::uint32_t subject) {
        at->start(subject == 2 ? TaskKind::kAnswer : TaskKind::kMessage, 0, 1.0, subject);
      });
  at = &cores;
  cores.start(TaskKind::kPath, 0, 10.0, 1);
  cores.wait_until(3.0, 2);  // Begins at 3, gives way at 3.5, goes on at 4.5.
  cores.wait_until(3.5, 3);
  cores.wait_until(4.0, 4);  // Waits for message 3.
  while (cores.step()) {
  }
  REQUIRE(done.size() == 4);
  CHECK(done[0] == std::pair(3u, 4.5));
  CHECK(done[1] == std::pair(4u, 5.5));
  CHECK(done[2] == std::pair(2u, 6.0));
  CHECK(done[3] == std::pair(1u, 13.0));
  CHECK(cores.seconds(0, TaskKind::kMessage) == 2.0);
}

TEST_CASE("two cores share tasks, and one thread makes the calls of MPI") {
  std::vector<double> done;
  RankCores* at = nullptr;
  RankCores cores(
      1, 2, [&](TaskKind, unsigned, std::uint32_t) { done.push_back(at->now()); }, [](std::uint32_t) {});
  at = &cores;
  for (std::uint32_t i = 0; i < 4; ++i) cores.start(TaskKind::kPath, 0, 1.0, i);
  for (std::uint32_t i = 4; i < 6; ++i) cores.start(TaskKind::kMessage, 0, 0.5, i);
  while (cores.step()) {
  }
  // One core has both messages and then two of the paths, the other one two paths.
  CHECK(done == std::vector{0.5, 1.0, 1.0, 2.0, 2.0, 3.0});
}

TEST_CASE("visits: two sums give the costs of parcels and rays, and are finite where they cannot") {
  const auto sums = [](double parcels, double rays) { return VisitSums{2.0 * parcels + 0.5 * rays, rays, parcels}; };
  const ParcelCosts costs = split(sums(10, 1000), sums(400, 1000));
  CHECK(costs.parcel == Approx(2.0));
  CHECK(costs.ray == Approx(0.5));
  // The same parcels twice, with times that differ: nothing tells parcels from rays.
  const ParcelCosts same = split({3.0, 100.0, 10.0}, {3.5, 100.0, 10.0});
  CHECK(same.parcel == 0.0);
  CHECK(same.ray == Approx(0.03));
  // Smaller parcels that took less time: no cost is negative.
  const ParcelCosts noise = split({3.0, 100.0, 10.0}, {2.0, 100.0, 40.0});
  CHECK(noise.parcel == 0.0);
  CHECK(noise.ray == Approx(0.03));
  const ParcelCosts none = split({}, {});
  CHECK(none.parcel == 0.0);
  CHECK(none.ray == 0.0);
}

TEST_CASE("one rank takes the sum of all times, and sends nothing") {
  const PartPictureCosts costs = picture(8);
  const double alone = 3e-6 * paths_of(costs);
  CHECK(seconds_alone(costs) == Approx(alone));
  const SimulatedPartRun run = simulate(costs, {}, {std::vector<unsigned>(8, 0), 1, 1});
  CHECK(run.seconds == Approx(alone));
  CHECK(run.worked == Approx(alone));
  CHECK(run.rays == Approx(paths_of(costs)));
  CHECK(run.sent == 0);
  CHECK(run.messages == 0);
}

TEST_CASE("even parts without costs of messages share the work") {
  for (const std::uint16_t ranks : {std::uint16_t{2}, std::uint16_t{4}, std::uint16_t{8}}) {
    const PartPictureCosts costs = picture(ranks, 64);
    const PartRun run{one_each(ranks), ranks, 1};
    const SimulatedPartRun simulated = simulate(costs, {}, run);
    CAPTURE(ranks, simulated.seconds);
    CHECK(simulated.worked == Approx(seconds_alone(costs)));
    CHECK(seconds_alone(costs) / (ranks * simulated.seconds) > 0.85);
    // Of the visits, those of a rank to its own part stay at home.
    CHECK(simulated.sent == Approx(paths_of(costs) * (ranks - 1) / ranks).epsilon(1e-6));
  }
}

TEST_CASE("a part that all rays visit is the bound") {
  PartPictureCosts costs = picture(1, 16);
  const PartRun run{{0}, 16, 1};
  const SimulatedPartRun simulated = simulate(costs, {}, run);
  // Rank 0 answers for 2 us per path; it follows hardly any itself.
  CHECK(simulated.seconds > 0.95 * 2e-6 * paths_of(costs));
  CHECK(simulated.seconds < 1.2 * 2e-6 * paths_of(costs));
}

TEST_CASE("random runs trace all rays once, keep their bounds, and repeat") {
  const std::uint64_t seed = 20261128;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const auto parts = static_cast<std::uint16_t>(1 + i % 7);
    const PartPictureCosts costs = random_picture(seed + i, parts);
    ExchangeCosts exchange;
    exchange.home_ray = exchange.owner_ray = 1e-8 * static_cast<double>(i);
    exchange.message_seconds = 1e-6 * static_cast<double>(i % 3);
    exchange.message_byte = 1e-10;
    exchange.latency = 1e-5 * static_cast<double>(i % 5);
    exchange.byte_per_second = i % 2 == 0 ? 1e12 : 1e8;
    PartRun run{{}, 1 + static_cast<unsigned>(i % 5), 1 + static_cast<unsigned>(i % 3)};
    for (std::uint16_t part = 0; part < parts; ++part) run.owner.push_back(part * run.ranks / parts);
    run.wave_paths = i % 4 == 0 ? 300.0 : 65536.0;
    run.credit = i % 3 == 0 ? 7.0 : 1e6;
    const SimulatedPartRun a = simulate(costs, exchange, run), b = simulate(costs, exchange, run);
    CAPTURE(seed, i, run.ranks, run.threads, a.seconds);
    CHECK(a.seconds == b.seconds);
    CHECK(a.seconds >= 0.999999 * least_seconds(a, run));
    CHECK(a.worked >= 0.97 * seconds_alone(costs));
    double rays = 0.0;
    for (std::uint32_t tile = 0; tile < costs.grid.tiles(); ++tile)
      for (const TraceCall& call : costs.calls[tile].calls) rays += call.rays * costs.steps;
    CHECK(a.rays == Approx(rays));
    CHECK(a.sent <= 1.03 * visits_of(costs));
    if (run.ranks == 1) CHECK(a.sent == 0);
    CHECK(a.bytes >= 32.0 * a.sent + 12.0 * a.messages);
    CHECK((a.messages > 0.0) == (a.sent > 0.0));
  }
}

TEST_CASE("latency, slow cards and little credit cost time") {
  const PartPictureCosts costs = picture(4, 16);
  const PartRun run{one_each(4), 4, 2};
  const double near = simulate(costs, {}, run).seconds;
  ExchangeCosts far;
  far.latency = 0.05;
  CHECK(simulate(costs, far, run).seconds > 1.1 * near);
  ExchangeCosts slow;
  slow.byte_per_second = 1e6;
  const SimulatedPartRun by_card = simulate(costs, slow, run);
  CHECK(by_card.seconds >= by_card.card);
  CHECK(by_card.card >= by_card.bytes / 4 / 1e6 / 2);
  PartRun poor = run;
  poor.credit = 16.0;
  ExchangeCosts near_by;
  near_by.latency = 1e-4;
  CHECK(simulate(costs, near_by, poor).seconds > 1.5 * simulate(costs, near_by, run).seconds);
  CHECK(simulate(costs, near_by, poor).sent == Approx(simulate(costs, near_by, run).sent).epsilon(0.2));
}
