#pragma once
/// The JSON provenance block of a file. Internal.

#include <hiprt_build/build.h>
#include <hiprt_build/exec/monitor.h>

#include <optional>
#include <string>
#include <string_view>

namespace hiprt::build {

/// What made the file and from what. Holds no times and no thread count: the same input gives the same bytes.
/// Its exchange slack is 0: set_exchange_slack().
/// @param monitor asked while the input is hashed. @param options with all that may be unset.
std::string make_provenance(Monitor& monitor, const SceneInput& scene, const BuildOptions& options,
                            const BuildStatistics& statistics, double sah_cost);

/// @param provenance of make_provenance(). @param exchange_slack 0 to 1.
void set_exchange_slack(std::span<char> provenance, double exchange_slack);

/// The tree of a file when it was built.
struct BuiltTree {
  SahCosts costs;                        ///< The defaults where the provenance has none.
  std::optional<double> sah_cost;        ///< Finite, above 0.
  std::optional<double> exchange_slack;  ///< 0 to 1.
};

/// @param provenance any bytes.
BuiltTree read_built_tree(std::string_view provenance);

}  // namespace hiprt::build
