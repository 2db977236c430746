#pragma once
/// Lets calls of AMD's runtime fail. libhiprt looks for its functions in the program first (hip_runtime_amd.cpp), so
/// the program's own ones, which it exports, stand before the runtime's.

namespace hiprt_api_test {

/// Counts the calls that may fail from now on: allocations, copies, fills, launches, events, waits and questions. Call
/// @p number does nothing and fails: allocations with hipErrorOutOfMemory, others with hipErrorUnknown. The first one
/// has number 1, and 0 lets none fail.
void fail_call(unsigned number);
/// Lets no more calls fail. @return how many there were since fail_call().
unsigned calls_that_may_fail();

/// Allocations of device memory, of host memory, and events that nobody has given back.
struct Held {
  long device, host, events;
  bool operator==(const Held&) const = default;
};
Held held();

}  // namespace hiprt_api_test
