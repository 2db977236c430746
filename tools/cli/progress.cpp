#include <tools/cli/progress.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include <unistd.h>

namespace hiprt::tools {

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

}  // namespace hiprt::tools
