#include <hiprt_build/exec/threads.h>
#include <hiprt_build/exec/threads_std.h>
#include <tests/catch.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <numeric>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace hiprt::build {
namespace {

/// A sum by halves, as the builders divide ranges.
template <class Library> long sum_by_halves(const std::vector<int>& values, std::size_t begin, std::size_t end) {
  if (end - begin <= 16) return std::accumulate(values.begin() + long(begin), values.begin() + long(end), 0L);
  const std::size_t middle = begin + (end - begin) / 2;
  long left = 0, right = 0;
  Library::invoke([&] { left = sum_by_halves<Library>(values, begin, middle); },
                  [&] { right = sum_by_halves<Library>(values, middle, end); });
  return left + right;
}

}  // namespace

TEMPLATE_TEST_CASE("a loop runs every body once, in a crew and alone", "", StdThreads, Threads) {
  const typename TestType::Limit limit(4);
  for (const std::size_t n : {0u, 1u, 2u, 3u, 1000u})
    for (const unsigned threads : {0u, 1u, 2u, 4u, 100u}) {
      CAPTURE(n, threads);
      std::vector<std::atomic<int>> runs(n);
      TestType::run(threads, [&] { TestType::for_each(n, [&](std::size_t i) { ++runs[i]; }); });
      TestType::for_each(n, [&](std::size_t i) { ++runs[i]; });
      for (const auto& run : runs) REQUIRE(run == 2);
    }
}

TEMPLATE_TEST_CASE("nested loops and halves give the result of one thread", "", StdThreads, Threads) {
  const typename TestType::Limit limit(4);
  std::vector<int> values(5000);
  std::iota(values.begin(), values.end(), 1);
  const long expected = 5000L * 5001 / 2;
  for (const unsigned threads : {1u, 3u, 4u}) {
    CAPTURE(threads);
    std::atomic<long> nested{0};
    TestType::run(threads, [&] {
      CHECK(sum_by_halves<TestType>(values, 0, values.size()) == expected);
      CHECK(TestType::reduce(
                values.size(), 100, 0L,
                [&](std::size_t begin, std::size_t end, long so_far) {
                  for (std::size_t i = begin; i < end; ++i) so_far += values[i];
                  return so_far;
                },
                std::plus<>{}) == expected);
      TestType::for_each(50, [&](std::size_t row) {
        TestType::for_each(100, [&](std::size_t column) { nested += values[row * 100 + column]; });
      });
    });
    CHECK(nested == expected);
  }
}

TEMPLATE_TEST_CASE("one of the exceptions of the bodies is passed on, and all threads have ended", "", StdThreads,
                   Threads) {
  const typename TestType::Limit limit(4);
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> running{0};
    const auto body = [&](std::size_t i) {
      ++running;
      if (i % 7 == 3) {
        --running;
        throw std::runtime_error("body");
      }
      --running;
    };
    CHECK_THROWS_WITH(TestType::run(4, [&] { TestType::for_each(100, body); }), "body");
    CHECK(running == 0);
    CHECK_THROWS_WITH(TestType::run(4, [&] { TestType::invoke([&] { body(3); }, [&] { body(0); }); }), "body");
    CHECK_THROWS_WITH(TestType::run(4, [&] { TestType::invoke([&] { body(0); }, [&] { body(3); }); }), "body");
    CHECK_THROWS_WITH(
        TestType::run(4, [&] { TestType::for_each(4, [&](std::size_t) { TestType::for_each(10, body); }); }), "body");
    CHECK(running == 0);
  }
}

TEMPLATE_TEST_CASE("no more threads work than were asked for", "", StdThreads, Threads) {
  const typename TestType::Limit limit(8);
  CHECK(TestType::count() == 8);
  for (const unsigned threads : {1u, 2u, 4u}) {
    std::mutex mutex;
    std::set<std::thread::id> ids;
    std::atomic<unsigned> running{0}, most{0};
    // A busy machine may start the other threads late: the first one waits for a second one.
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    const auto is_alone = [&] {
      const std::lock_guard lock(mutex);
      ids.insert(std::this_thread::get_id());
      return ids.size() == 1;
    };
    TestType::run(threads, [&] {
      TestType::for_each(4, [&](std::size_t) {
        TestType::for_each(20, [&](std::size_t) {
          const unsigned now = ++running;
          for (unsigned before = most; before < now && !most.compare_exchange_weak(before, now);) {
          }
          do {
            std::this_thread::sleep_for(std::chrono::microseconds(200));
          } while (is_alone() && threads > 1 && std::chrono::steady_clock::now() < deadline);
          --running;
        });
      });
    });
    CHECK(most <= threads);
    if (threads > 1) CHECK(ids.size() > 1);
  }
}

}  // namespace hiprt::build
