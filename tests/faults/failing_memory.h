#pragma once
/// Operators new and delete of the whole program, which count allocations and let one fail. Link failing_memory.cpp.

#include <cstdint>

namespace hiprt::checks {

/// Which allocations fail.
enum class Failing {
  kOne,   ///< The chosen one.
  kRest,  ///< The chosen one and all that follow: there is no memory for messages either.
};

/// Counts allocations from now on. Allocation @p number fails; the first one has number 1, and 0 lets none fail.
void start_failing(std::uint64_t number, Failing failing = Failing::kOne);
/// Lets no more allocations fail. @return how many there were since start_failing().
std::uint64_t stop_failing();
/// Bytes of the first allocation that failed since start_failing(), if it was one of build::allocate_pages(); else 0.
std::uint64_t failed_array();

/// Allocations of the program that are not freed.
std::int64_t live_allocations();

}  // namespace hiprt::checks
