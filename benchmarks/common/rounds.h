#pragma once
/// Fair timing on a noisy machine: all contestants run in turn for several rounds, and only times of the same round are
/// compared.

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

/// One of the competitors. run() does the work once and returns its seconds.
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
/// Median over the rounds of reference[r] / seconds[r]: the speed relative to the reference.
double median_speed_ratio(const std::vector<double>& seconds, const std::vector<double>& reference);
/// @return NaN for no values. @pre all are positive.
double geometric_mean(const std::vector<double>& values);

}  // namespace hiprt::bench
