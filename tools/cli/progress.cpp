#include <tools/cli/progress.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <string>

#include <unistd.h>

namespace hiprt::tools {
namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

void request_stop(int) { stop_requested.store(true, std::memory_order_relaxed); }

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP, SIGXFSZ};
std::array<struct sigaction, kSignals.size()> old_actions;

}  // namespace

bool stderr_is_terminal() { return isatty(STDERR_FILENO) != 0; }

void ProgressBar::update(const char* step, double fraction) {
  if (!enabled_) return;
  const auto now = std::chrono::steady_clock::now();
  if (drawn_ && now - last_ < std::chrono::milliseconds(50)) return;
  constexpr int kWidth = 32;
  const double done = std::clamp(fraction, 0.0, 1.0);
  const auto filled = static_cast<std::size_t>(done * kWidth);
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r\033[K%-10s [%s] %3.0f%%", step, bar.c_str(), done * 100);
  std::fflush(stderr);
  drawn_ = true;
  last_ = now;
}

void ProgressBar::clear() {
  if (!drawn_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  drawn_ = false;
}

InterruptGuard::InterruptGuard() {
  stop_requested = false;
  struct sigaction action = {};
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &old_actions[i]);
    // A parent that has a signal ignored (nohup) means it.
    if (old_actions[i].sa_handler == SIG_IGN) continue;
    // At the limit of file sizes writing shall fail with a message.
    action.sa_handler = kSignals[i] == SIGXFSZ ? SIG_IGN : request_stop;
    sigaction(kSignals[i], &action, nullptr);
  }
}

InterruptGuard::~InterruptGuard() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &old_actions[i], nullptr);
}

bool interrupted() { return stop_requested.load(std::memory_order_relaxed); }

}  // namespace hiprt::tools
