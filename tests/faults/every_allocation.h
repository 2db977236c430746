#pragma once
/// Runs an operation with each of its allocations failing.

#include <hiprt_build/error.h>
#include <hiprt_build/format/out_of_memory.h>
#include <tests/faults/failing_memory.h>
#include <tests/oracle/random.h>

#include <tests/catch.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <regex>
#include <string>
#include <vector>

namespace hiprt::checks {

inline constexpr std::uint64_t kFaultSeed = 34;

/// Most allocations of an operation that fail, one per run.
#if defined(HIPRT_QUICK_TESTS)
inline constexpr std::uint64_t kMost = 40;
#else
inline constexpr std::uint64_t kMost = 100000;
#endif

/// The numbers of all allocations, or of a part: the first ones, the last ones and random ones.
inline std::vector<std::uint64_t> chosen_allocations(std::uint64_t count, std::uint64_t most) {
  std::vector<std::uint64_t> numbers;
  oracle::Random random(kFaultSeed);
  for (std::uint64_t n = 1; n <= count; ++n)
    if (count <= most || n <= most / 4 || n + most / 8 > count) numbers.push_back(n);
  while (count > most && numbers.size() < most)
    numbers.push_back(1 + random.below(static_cast<unsigned>(std::min<std::uint64_t>(count, 0xffffffffu))));
  return numbers;
}

/// @return what an error of too little memory does not name. Where all allocations fail there is no memory for a text.
inline std::string missing_in(const std::string& message, Failing failing) {
  static const std::regex sizes(": ([0-9]+ bytes wanted, [0-9]+ free|[0-9]+ bytes free)$");
  if (failing == Failing::kRest && message == "out of memory") return {};
  if (build::free_memory() && !std::regex_search(message, sizes)) return "free bytes";
  if (failed_array() != 0 && message.find(": " + std::to_string(failed_array()) + " bytes wanted") == std::string::npos)
    return "wanted bytes";
  return {};
}

/// What check_every_allocation() has seen.
struct FaultCount {
  std::uint64_t injected = 0, errors = 0, survived = 0, with_sizes = 0;
};

/// @param operation returns a Result. With each failing allocation it must succeed without that memory, or return
/// kOutOfMemory in one line that names the free bytes, and leak nothing. Where an array of the builder failed it also
/// names its bytes. Then the operation must succeed as before.
/// @param most allocations that fail, one per run.
/// @param after called after each run.
template <class Operation, class After>
FaultCount check_every_allocation(const std::string& name, std::uint64_t most, const Operation& operation,
                                  const After& after) {
  CAPTURE(name);
  // What libraries allocate once.
  for (int i = 0; i < 2; ++i) REQUIRE(operation().has_value());
  start_failing(0);
  static_cast<void>(operation());
  const std::uint64_t count = stop_failing();
  FaultCount seen;
  for (const Failing failing : {Failing::kOne, Failing::kRest})
    for (const std::uint64_t number : chosen_allocations(count, most)) {
      std::string thrown, message;
      build::ErrorCode code = build::ErrorCode::kOutOfMemory;
      bool failed = false;
      start_failing(number, failing);
      try {
        const auto result = operation();
        stop_failing();
        if (!result) {
          failed = true;
          code = result.error().code;
          message = result.error().message;
        }
      } catch (const std::exception& exception) {
        stop_failing();
        thrown = exception.what();
      }
      ++seen.injected;
      (failed ? seen.errors : seen.survived) += 1;
      seen.with_sizes += message.find("bytes wanted") != std::string::npos ? 1 : 0;
      const std::string missing = failed ? missing_in(message, failing) : std::string();
      const bool good = thrown.empty() && missing.empty() &&
                        (!failed || (code == build::ErrorCode::kOutOfMemory && !message.empty() &&
                                     message.find('\n') == std::string::npos));
      INFO("allocation " << number << " of " << count << (failing == Failing::kRest ? " and the rest" : "")
                         << ", thrown: '" << thrown << "', message: '" << message << "', without: '" << missing << "'");
      if (!good) CHECK(good);
      after();
      if (number % 50 == 1) REQUIRE(operation().has_value());
    }
  REQUIRE(operation().has_value());
  const std::int64_t before = live_allocations();
  for (const Failing failing : {Failing::kOne, Failing::kRest})
    for (const std::uint64_t number : chosen_allocations(count, most)) {
      start_failing(number, failing);
      try {
        static_cast<void>(operation());
      } catch (const std::exception&) {
      }
      stop_failing();
    }
  CHECK(live_allocations() == before);
  std::printf("%s: %llu allocations, %llu faults, %llu errors (%llu with sizes), %llu survived\n", name.c_str(),
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(seen.injected),
              static_cast<unsigned long long>(seen.errors), static_cast<unsigned long long>(seen.with_sizes),
              static_cast<unsigned long long>(seen.survived));
  return seen;
}

template <class Operation>
FaultCount check_every_allocation(const std::string& name, std::uint64_t most, const Operation& operation) {
  return check_every_allocation(name, most, operation, [] {});
}

}  // namespace hiprt::checks
