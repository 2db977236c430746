#pragma once
/// A progress bar for people, and interruption by Ctrl-C.

#include <chrono>
#include <string>

namespace hiprt::tools {

bool stderr_is_terminal();

/// One line on stderr that is redrawn in place; nothing at all when stderr is not a terminal. Erased when destroyed.
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

 private:
  bool enabled_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point last_{};
};

/// While it lives, SIGINT, SIGTERM and SIGHUP do not end the program but make interrupted() true (unless they were
/// ignored before), and SIGXFSZ does nothing. One at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  ~InterruptGuard();
};

/// Was the program asked to stop since the InterruptGuard was made? May be called from any thread.
bool interrupted();

}  // namespace hiprt::tools
