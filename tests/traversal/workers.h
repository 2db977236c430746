#pragma once
/// Work spread over threads, and how much of it a build of this kind can afford.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace hiprt::checks {

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HIPRT_CHECKS_SLOW 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
#define HIPRT_CHECKS_SLOW 1
#endif

/// Sanitized and unoptimised builds, and the quick set (HIPRT_TEST_SET), do a part of the random work.
#if defined(HIPRT_CHECKS_SLOW)
inline constexpr unsigned kWorkDivisor = 25;
#undef HIPRT_CHECKS_SLOW
#elif defined(HIPRT_QUICK_TESTS)
inline constexpr unsigned kWorkDivisor = 3;
#else
inline constexpr unsigned kWorkDivisor = 1;
#endif

/// @return the number of random trials for this build, given that of a release build.
constexpr unsigned trials(unsigned release) { return release / kWorkDivisor > 0 ? release / kWorkDivisor : 1; }

/// Calls function(i, result) for i in [0, count) on all processors, each thread with a Result of its own.
/// @return the threads' results. Catch2's assertions are not safe in threads: assert on the results.
/// Plain threads, because the thread sanitizer cannot see into the TBB library.
template <class Result, class Function>
std::vector<Result> for_each_parallel(std::size_t count, const Function& function) {
  const std::size_t threads = std::max<std::size_t>(2, std::thread::hardware_concurrency());
  std::vector<Result> results(threads);
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> pool;
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
