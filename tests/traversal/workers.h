#pragma once
/// Runs work on several threads.

#include <tests/amount.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace hiprt::checks {

/// Calls function(i, result) for i in [0, count) on all processors, each thread with its own Result.
/// @return the threads' results. Catch2's assertions are not safe in threads: assert on the results.
/// Plain threads, because the thread sanitizer cannot see into the TBB library.
template <class Result, class Function>
std::vector<Result> for_each_parallel(std::size_t count, const Function& function) {
  const std::size_t threads = std::max<std::size_t>(2, std::thread::hardware_concurrency());
  std::vector<Result> results(threads);
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> pool;
  pool.reserve(threads);
  for (std::size_t k = 0; k < threads; ++k)
    pool.emplace_back([&, k] {
      Result own{};
      for (std::size_t i = next++; i < count; i = next++) function(i, own);
      results[k] = std::move(own);
    });
  pool.clear();
  return results;
}

}  // namespace hiprt::checks
