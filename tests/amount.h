#pragma once
/// How much of the work of a test a build of this kind does.

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

/// Which cases of nested loops are run: all, and in the quick set the first and each every-th after it. Every should
/// have no divisor in common with the lengths of the inner loops, so that each of their values has its turn.
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
