#pragma once
/// A progress bar on the terminal.

#include <tools/base/progress_sink.h>

#include <chrono>

namespace hiprt::tools {

bool stderr_is_terminal();

/// One line on stderr that is redrawn in place and erased by the destructor. Without a terminal nothing is drawn.
class ProgressBar {
 public:
  explicit ProgressBar(bool enabled = stderr_is_terminal()) : enabled_(enabled) {}
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar() { clear(); }

  /// @param fraction 0 to 1. Redraws at most every 50 ms, so it may be called often.
  void update(const char* step, double fraction);
  /// Erases the line.
  void clear();

  /// Draws what it is told. @pre it is called by one thread at a time, and not after the bar's end.
  ProgressSink sink() {
    return [this](const char* step, double fraction) { update(step, fraction); };
  }

 private:
  bool enabled_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace hiprt::tools
