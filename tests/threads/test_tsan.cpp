// Tests the thread sanitizer's setting itself: it must be silent about what oneTBB orders and see what nothing orders.

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <tests/catch.h>
#include <chrono>
#include <functional>
#include <numeric>
#include <thread>
#include <vector>

namespace {

constexpr int kThreads = 4;
constexpr int kCount = 20000;

/// Runs on four threads, however many processors there are.
template <class Body> void on_four_threads(const Body& body) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, kThreads);
  tbb::task_arena(kThreads).execute(body);
}

/// Calls of itself that nothing but fork and join order; each writes what its caller reads.
void add_up(const std::vector<int>& values, std::size_t begin, std::size_t end, long& sum) {
  if (end - begin < 100) {
    sum = std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(begin),
                          values.begin() + static_cast<std::ptrdiff_t>(end), 0L);
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  long left = 0, right = 0;
  tbb::parallel_invoke([&] { add_up(values, begin, middle, left); }, [&] { add_up(values, middle, end, right); });
  sum = left + right;
}

}  // namespace

TEST_CASE("loops, reductions and recursion over oneTBB do not count as races", "[ordered]") {
  on_four_threads([] {
    std::vector<int> values(kCount);
    for (int round = 0; round < 10; ++round) {
      tbb::parallel_for(0, kCount, [&](int i) { values[static_cast<std::size_t>(i)] += i; });
      const long reduced = tbb::parallel_reduce(
          tbb::blocked_range<std::size_t>(0, values.size()), 0L,
          [&](const auto& range, long sum) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) sum += values[i];
            return sum;
          },
          std::plus<>{});
      long recursive = 0, in_group = 0;
      add_up(values, 0, values.size(), recursive);
      tbb::task_group group;
      group.run([&] { add_up(values, 0, values.size(), in_group); });
      group.wait();
      REQUIRE(reduced == std::accumulate(values.begin(), values.end(), 0L));
      REQUIRE(recursive == reduced);
      REQUIRE(in_group == reduced);
    }
  });
}

TEST_CASE("two bodies of one loop that write the same variable count as a race", "[.race]") {
  // ctest passes when the sanitizer reports this one.
  on_four_threads([] {
    int sum = 0;
    tbb::parallel_for(0, kCount, [&](int i) {
      if (i % 1000 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      sum += i & 1;
    });
    CHECK(sum >= 0);
  });
}
