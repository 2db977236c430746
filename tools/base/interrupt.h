#pragma once
/// Interruption by Ctrl-C. Long loops call interrupted() and return early.

#include <tools/base/errors.h>

#include <cstdint>

namespace hiprt::tools {

/// While a guard lives, SIGINT, SIGTERM and SIGHUP do not end the program but make interrupted() true. A signal that
/// the parent process had set to be ignored stays ignored. At most one guard may live at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  ~InterruptGuard();
};

/// Whether a signal has asked the program to stop since the InterruptGuard was made. May be called from any thread.
bool interrupted();

/// interrupted(), asked once per 4096 steps of a loop. @param step number of the step.
inline bool interrupted_at(std::uint64_t step) { return step % 4096 == 0 && interrupted(); }

/// What a function returns after interrupted() became true.
inline tl::unexpected<build::Error> cancelled() {
  return tl::unexpected<build::Error>(build::Error{build::ErrorCode::kCancelled, "cancelled"});
}

}  // namespace hiprt::tools
