#pragma once
/// Times of an operation's steps. Internal.

#include <chrono>
#include <utility>

namespace hiprt::build {

class Stopwatch {
 public:
  /// Seconds since the last call or the construction.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace hiprt::build
