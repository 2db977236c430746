#pragma once
/// Markdown tables of the figures.

#include "measure.h"

#include <string>
#include <vector>

namespace hiprt::bench {

/// @param rounds of builds and of traces.
std::string builders_markdown(const std::vector<BuilderCell>& cells, unsigned rounds);

}  // namespace hiprt::bench
