#pragma once
/// What the names of builders stand for where an option is not set. Internal.

#include <hiprt_build/build.h>

namespace hiprt::build {

struct BuilderDefaults {
  double split_budget;
  unsigned reinsertion_rounds;
};

inline constexpr BuilderDefaults kDefaults{1.5, 0};
/// Of Builder::kHq, on CPU and GPU. Such trees trace fastest of all that were tried (decision 0013). 64 rounds lower
/// the SAH cost of sponza by another 0.4 %, 256 rounds no further (decision 0011).
inline constexpr BuilderDefaults kHqDefaults{3.0, 32};

/// @tparam Options BuildOptions or gpu::BuildOptions. @return the same with nothing unset.
template <class Options> Options with_defaults(Options options) {
  const BuilderDefaults& defaults = options.builder == Builder::kHq ? kHqDefaults : kDefaults;
  options.split_budget = options.split_budget.value_or(defaults.split_budget);
  options.reinsertion_rounds = options.reinsertion_rounds.value_or(defaults.reinsertion_rounds);
  return options;
}

}  // namespace hiprt::build
