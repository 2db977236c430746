#pragma once
/// Calls of the system that fail in tests. The program's own `fault` chooses one, and functions that the linker puts
/// before the system's (--wrap, see CMakeLists.txt) ask it.

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <limits>

namespace hiprt::checks {

/// One call in the order of all calls fails, and reads and writes are short. Several threads may call next().
struct FailingCall {
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  std::atomic<unsigned> calls{0};
  unsigned at = 0;                    ///< From 1; 0: none fails.
  int error = 0;                      ///< 0: the call is a read that finds the end of the file.
  std::size_t most = kAll;            ///< Bytes that one call reads or writes at most.
  std::atomic<const char*> name{""};  ///< Of the function that failed.

  void start(unsigned which, int number, std::size_t bytes = kAll) {
    calls = 0;
    at = which;
    error = number;
    most = bytes;
    name = "";
  }
  /// @return how many calls there were.
  unsigned stop() {
    const unsigned seen = calls;
    start(0, 0);
    return seen;
  }
  bool next(const char* function) {
    if (++calls != at) return false;
    name = function;
    errno = error;
    return true;
  }
};

inline FailingCall fault;

}  // namespace hiprt::checks
