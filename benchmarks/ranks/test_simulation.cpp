// Runs on ranks that do not exist: what must hold whatever the machine.

#include "simulation.h"

#include <tests/catch.h>

#include <cmath>
#include <numeric>

namespace {

using namespace hiprt;
using namespace hiprt::bench;

/// A picture whose right half costs @p times as much as its left half, 1 ms per step and tile.
PictureCosts picture(std::uint32_t side, std::uint32_t steps, double times = 1.0) {
  PictureCosts costs{{side, side, 32}, steps, 32, {}, 0.0};
  for (std::uint32_t tile = 0; tile < costs.grid.tiles(); ++tile)
    costs.tile_seconds.push_back(tile % costs.grid.columns() < costs.grid.columns() / 2 ? 1e-3 : 1e-3 * times);
  return costs;
}

double work_of(const PictureCosts& costs) {
  return costs.steps * std::accumulate(costs.tile_seconds.begin(), costs.tile_seconds.end(), 0.0);
}

double efficiency(const PictureCosts& costs, const RankCosts& ranks_cost, unsigned ranks, unsigned workers) {
  const SimulatedRun run = simulate(costs, ranks_cost, ranks, workers, 1);
  CHECK(run.worked == Approx(work_of(costs)));
  return run.worked / (run.seconds * ranks * workers);
}

}  // namespace

TEST_CASE("one worker takes the sum of all times") {
  const PictureCosts costs = picture(256, 64, 3);
  const SimulatedRun run = simulate(costs, {}, 1, 1, 1);
  CHECK(run.seconds == Approx(work_of(costs)));
  CHECK(run.bytes == 0);
  CHECK(run.dealing == 0);
}

TEST_CASE("ranks without costs share the work, also uneven work") {
  for (const double times : {1.0, 20.0})
    for (const unsigned ranks : {2u, 16u}) {
      CAPTURE(times, ranks);
      const double found = efficiency(picture(1024, 256, times), {}, ranks, 4);
      CHECK(found > (times == 1.0 ? 0.97 : 0.9));
      CHECK(found <= 1.0);
    }
}

TEST_CASE("no run is faster than its bounds, and a slow rank 0 is one of them") {
  const PictureCosts costs = picture(1024, 64);
  for (const double unit_seconds : {0.0, 1e-4, 1e-2})
    for (const double byte_per_second : {1e12, 1e7})
      for (const unsigned ranks : {1u, 8u, 64u}) {
        RankCosts ranks_cost;
        ranks_cost.unit_seconds = unit_seconds;
        ranks_cost.rank_seconds = 1e-3 * unit_seconds;
        ranks_cost.byte_seconds = 1e-9;
        ranks_cost.byte_per_second = byte_per_second;
        ranks_cost.latency = 1e-4;
        ranks_cost.message_seconds = unit_seconds;
        const SimulatedRun run = simulate(costs, ranks_cost, ranks, 4, 2);
        CAPTURE(unit_seconds, byte_per_second, ranks, run.seconds, run.units);
        CHECK(run.seconds >= 0.999999 * least_seconds(run, ranks, 4));
        CHECK(run.worked == Approx(work_of(costs)));
        // The sums that the page gives.
        const double units = static_cast<double>(run.units), bytes = static_cast<double>(run.bytes);
        CHECK(run.dealing >= 0.999999 * (units * (unit_seconds + ranks * ranks_cost.rank_seconds) + bytes * 1e-9));
        CHECK(run.card >= 0.499999 * bytes / byte_per_second);
        CHECK(run.messaging <= 2.000001 * units * ranks_cost.message_seconds);
        CHECK((run.messaging > 0.0) == (ranks > 1 && unit_seconds > 0.0));
      }
  RankCosts slow;
  slow.unit_seconds = 1.0;
  const SimulatedRun run = simulate(costs, slow, 64, 4, 2);
  CHECK(run.seconds > static_cast<double>(run.units) - 1.0);
}

TEST_CASE("a network costs time, and less work per message costs more") {
  RankCosts far;
  far.latency = 0.05;
  far.tick = 0.001;
  const PictureCosts costs = picture(512, 512);
  const double near = efficiency(costs, {}, 8, 2);
  CHECK(efficiency(costs, far, 8, 2) < near);
  // Two units of half a second per worker hide a twentieth of a second.
  CHECK(efficiency(costs, far, 8, 2) > 0.9 * near);
}

TEST_CASE("random times have the mean that they are drawn around, and the seed repeats them") {
  PictureCosts costs = picture(1024, 256);
  costs.deviation = 0.5;
  const SimulatedRun a = simulate(costs, {}, 4, 4, 7), b = simulate(costs, {}, 4, 4, 7),
                     c = simulate(costs, {}, 4, 4, 8);
  CHECK(a.seconds == b.seconds);
  CHECK(a.seconds != c.seconds);
  CHECK(a.worked == Approx(work_of(costs)).epsilon(0.01));
}
