// Which unit of work goes to which rank. The judge is a list that is searched from its start.

#include <tests/catch.h>
#include <tests/oracle/random.h>
#include <tools/distributed/deal_queue.h>

#include <algorithm>
#include <vector>

using namespace hiprt;
using namespace hiprt::tools;

TEST_CASE("dealer: the most expensive unit comes first, of equal costs the lowest number") {
  const std::vector<double> costs{1, 5, 3, 5, 0};
  DealQueue queue(costs, 2, 1);
  for (const std::size_t expected : {1u, 3u, 2u, 0u, 4u}) CHECK(queue.next(static_cast<int>(expected % 2)) == expected);
  CHECK_FALSE(queue.next(0));
  CHECK_FALSE(queue.ended());
}

TEST_CASE("dealer: a unit is done once, by the rank that has it") {
  DealQueue queue(std::vector<double>{1}, 3, 1);
  REQUIRE(queue.next(1) == 0u);
  CHECK_FALSE(queue.finish(2, 0));
  CHECK(queue.finish(1, 0));
  CHECK_FALSE(queue.finish(1, 0));
  CHECK(queue.ended());
  CHECK(queue.not_done().empty());
}

TEST_CASE("dealer: the units of a lost rank are dealt again, not to rank 0 while others live, and then given up") {
  DealQueue queue(std::vector<double>{4, 9}, 3, 1);
  REQUIRE(queue.next(1) == 1u);
  CHECK(queue.lose(1) == std::vector<std::size_t>{1});
  CHECK(queue.next(0) == 0u);
  CHECK_FALSE(queue.next(0));
  REQUIRE(queue.next(2) == 1u);
  CHECK(queue.finish(0, 0));
  CHECK(queue.lose(2) == std::vector<std::size_t>{1});
  CHECK(queue.ended());
  CHECK(queue.not_done() == std::vector<std::size_t>{1});

  DealQueue alone(std::vector<double>{1}, 2, 1);
  REQUIRE(alone.next(1) == 0u);
  alone.lose(1);
  CHECK(alone.next(0) == 0u);
}

TEST_CASE("dealer: with ranks lost at random every unit is done once or lost twice") {
  oracle::Random random(41);
  for (int round = 0; round < 200; ++round) {
    const int ranks = 2 + static_cast<int>(random.below(5));
    std::vector<double> costs(random.below(30));
    for (double& cost : costs) cost = static_cast<double>(random.below(4));
    DealQueue queue(costs, ranks, 1);
    std::vector<int> done(costs.size()), lost(costs.size());
    std::vector<std::vector<std::size_t>> running(static_cast<std::size_t>(ranks));
    while (!queue.ended()) {
      const auto rank = static_cast<std::size_t>(random.below(static_cast<std::uint32_t>(ranks)));
      if (queue.is_lost(static_cast<int>(rank))) continue;
      if (rank != 0 && random.below(20) == 0) {
        for (const std::size_t unit : queue.lose(static_cast<int>(rank))) ++lost[unit];
        running[rank].clear();
      } else if (!running[rank].empty() && random.below(2) == 0) {
        CHECK(queue.finish(static_cast<int>(rank), running[rank].back()));
        ++done[running[rank].back()];
        running[rank].pop_back();
      } else if (const auto unit = queue.next(static_cast<int>(rank))) {
        running[rank].push_back(*unit);
      }
    }
    for (std::size_t i = 0; i < costs.size(); ++i) CHECK((done[i] == 1) != (lost[i] == 2));
  }
}
