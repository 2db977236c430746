#pragma once
/// Fair timing on a noisy machine: everything that is compared runs in turn, several times, and what is compared are
/// times of the same round.

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

/// Something that is timed against others. run() does all the work once and returns the seconds that count.
struct Contestant {
  std::string name;
  std::function<double()> run;
};

/// seconds[contestant][round], in the contestants' order.
using Timings = std::vector<std::vector<double>>;

/// Runs all contestants once per round, one after the other; each round starts with another one.
Timings run_rounds(const std::vector<Contestant>& contestants, unsigned rounds);

/// Seconds that @p work takes.
double time_of(const std::function<void()>& work);

/// @pre !values.empty()
double median(std::vector<double> values);
/// Median over the rounds of reference[r] / seconds[r]: how many times as fast as the reference.
double median_speed_ratio(const std::vector<double>& seconds, const std::vector<double>& reference);
/// @return NaN for no values. @pre all are positive.
double geometric_mean(const std::vector<double>& values);

}  // namespace hiprt::bench
