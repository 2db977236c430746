#pragma once
/// Markdown tables of the figures.

#include "builders.h"
#include "growth.h"
#include "validation.h"

#include <string>
#include <vector>

namespace hiprt::bench {

/// @param rounds of the builders.
std::string build_markdown(const std::vector<BuildCell>& builds, const std::vector<ValidationCell>& validations,
                           const std::vector<GrowthCell>& growths, unsigned rounds);

}  // namespace hiprt::bench
