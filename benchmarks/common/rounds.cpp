#include "rounds.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace hiprt::bench {

Timings run_rounds(const std::vector<Contestant>& contestants, unsigned rounds) {
  const std::size_t count = contestants.size();
  Timings seconds(count, std::vector<double>(rounds));
  for (unsigned round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t turn = (i + round) % count;
      seconds[turn][round] = contestants[turn].run();
    }
  return seconds;
}

double time_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

double median_speed_ratio(const std::vector<double>& seconds, const std::vector<double>& reference) {
  std::vector<double> ratios(seconds.size());
  std::transform(reference.begin(), reference.end(), seconds.begin(), ratios.begin(), std::divides<>());
  return median(ratios);
}

double geometric_mean(const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0;
  for (const double value : values) sum += std::log(value);
  return std::exp(sum / static_cast<double>(values.size()));
}

}  // namespace hiprt::bench
