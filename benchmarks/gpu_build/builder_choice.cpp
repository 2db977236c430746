#include "builder_choice.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

namespace hiprt::bench {
namespace {

using build::Builder;
using build::Result;

Result<Builder> find_builder(const std::string& name) {
  for (const Builder builder :
       {Builder::kLbvh, Builder::kLbvh30, Builder::kHploc, Builder::kPloc, Builder::kSah, Builder::kSbvh, Builder::kHq})
    if (name == build::name(builder)) return builder;
  return gpu::fail(build::ErrorCode::kInvalidInput, "no builder '", name,
                   "'; there are lbvh, lbvh30, hploc, ploc, sah, sbvh, hq");
}

}  // namespace

Result<gpu::BuildOptions> parse_builder(const std::string& text) {
  std::istringstream parts(text);
  std::string part;
  std::getline(parts, part, ':');
  const auto builder = find_builder(part);
  if (!builder) return tl::unexpected(builder.error());
  gpu::BuildOptions options{.builder = *builder};
  while (std::getline(parts, part, ':')) {
    double value = 0;
    char name[16] = {}, end = 0;
    if (std::sscanf(part.c_str(), "%15[a-z]=%lf%c", name, &value, &end) != 2 || !(value >= 0 && value <= 1000))
      return gpu::fail(build::ErrorCode::kInvalidInput, "'", part, "' is not NAME=NUMBER");
    const std::string key = name;
    if (key == "split")
      options.split_budget = value;
    else if (key == "presplit")
      options.presplit_budget = value;
    else if (key == "rounds")
      options.reinsertion_rounds = static_cast<unsigned>(value);
    else if (key == "radius")
      options.ploc_radius = static_cast<unsigned>(value);
    else
      return gpu::fail(build::ErrorCode::kInvalidInput, "no '", key, "'; there are split, presplit, rounds, radius");
  }
  return options;
}

std::string file_name(std::string builder) {
  std::replace(builder.begin(), builder.end(), ':', '_');
  std::erase(builder, '=');
  return builder;
}

}  // namespace hiprt::bench
