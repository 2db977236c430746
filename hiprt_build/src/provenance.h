#pragma once
/// The JSON provenance block of a file. Internal.

#include <hiprt_build/build.h>

#include <optional>
#include <string>
#include <string_view>

namespace hiprt::build {

/// What made the file and from what. Holds no times and no thread count: the same input gives the same bytes.
std::string make_provenance(const SceneInput& scene, const BuildOptions& options, const BuildStatistics& statistics,
                            double sah_cost);

/// What the tree of a file cost when it was built, and by which costs of its parts.
struct BuiltCost {
  SahCosts costs;                  ///< The defaults where the provenance has none.
  std::optional<double> sah_cost;  ///< Finite, above 0.
};

/// @param provenance any bytes.
BuiltCost read_built_cost(std::string_view provenance);

}  // namespace hiprt::build
