#pragma once
/// The share of a test's random work that this build does.

namespace hiprt::checks {

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HIPRT_CHECKS_SLOW 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
#define HIPRT_CHECKS_SLOW 1
#endif

/// Sanitized and unoptimised builds, and the quick and fast sets (HIPRT_TEST_SET), do a part of the random work.
#if defined(HIPRT_CHECKS_SLOW) || defined(HIPRT_FAST_TESTS)
inline constexpr unsigned kWorkDivisor = 25;
#elif defined(HIPRT_QUICK_TESTS)
inline constexpr unsigned kWorkDivisor = 3;
#else
inline constexpr unsigned kWorkDivisor = 1;
#endif

/// @return the number of random trials for this build, given that of a release build.
constexpr unsigned trials(unsigned release) { return release / kWorkDivisor > 0 ? release / kWorkDivisor : 1; }

/// Chooses cases of nested loops: all cases, or in the quick set the first one and then one of @p every. Let @p every
/// have no divisor in common with the lengths of the inner loops, so that each of their values occurs.
class Sample {
 public:
#if defined(HIPRT_QUICK_TESTS)
  explicit Sample(unsigned every) : every_(every) {}
#else
  explicit Sample(unsigned) {}
#endif

  /// Called once for each case, in their order. @return whether it is run.
  bool next() { return number_++ % every_ == 0; }

 private:
  unsigned every_ = 1, number_ = 0;
};

}  // namespace hiprt::checks
