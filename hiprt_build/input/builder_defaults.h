#pragma once
/// What the names of builders stand for where an option is not set. Internal.

#include <hiprt_build/build.h>

namespace hiprt::build {

/// When a builder from the top splits by planes, and how.
struct SplitRules {
  /// Planes are tried where the halves of the best object split overlap by more than this part of the scene's area
  /// (Stich et al. 2009, section 4.2).
  float least_overlap;
  /// Planes may also divide references by where their boxes begin or end, and cut none. Such a split is taken if it
  /// costs less than this share of the best one with cuts. 0: they are not tried.
  float whole_share;
};

struct BuilderDefaults {
  double split_budget;
  unsigned reinsertion_rounds;
  SplitRules splits;
};

/// A lower least_overlap makes Builder::kSbvh slower: rays gain 2 % from 1e-5, the build takes 1.6 times as long
/// (decision 0023). Splits without cuts would make its rays slower in sponza (decision 0023).
inline constexpr BuilderDefaults kDefaults{1.5, 0, {3e-4f, 0.0f}};
/// Of Builder::kHq, on CPU and GPU. Such trees trace fastest of all that were tried (decision 0013). 64 rounds lower
/// the SAH cost of sponza by another 0.4 %, 256 rounds no further (decision 0011).
inline constexpr BuilderDefaults kHqDefaults{3.0, 32, {1e-5f, 0.9f}};

inline constexpr const BuilderDefaults& defaults_of(Builder builder) {
  return builder == Builder::kHq ? kHqDefaults : kDefaults;
}

/// Whether the budget follows from the scene (presplit/split_demand.h). @tparam Options BuildOptions or
/// gpu::BuildOptions.
template <class Options> bool splits_as_needed(const Options& options) {
  return options.split_budget == kSplitsAsNeeded &&
         (options.builder == Builder::kSbvh || options.builder == Builder::kHq);
}

/// @tparam Options BuildOptions or gpu::BuildOptions. @return the same with nothing unset. The budget of
/// kSplitsAsNeeded is the least one.
template <class Options> Options with_defaults(Options options) {
  const BuilderDefaults& defaults = defaults_of(options.builder);
  if (options.split_budget.value_or(kSplitsAsNeeded) == kSplitsAsNeeded) options.split_budget = defaults.split_budget;
  options.reinsertion_rounds = options.reinsertion_rounds.value_or(defaults.reinsertion_rounds);
  return options;
}

}  // namespace hiprt::build
