#pragma once
/// Times that other programs on the machine do not change.

#include <ctime>

namespace hiprt::test {

/// Milliseconds that all threads of this process have worked.
inline double cpu_milliseconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

}  // namespace hiprt::test
