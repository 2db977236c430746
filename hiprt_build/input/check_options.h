#pragma once
/// Ranges of the options that builds on the CPU and on the GPU share. Internal.

#include <hiprt_build/build.h>
#include <hiprt_device/format/widened_boxes.h>

#include <sstream>

namespace hiprt::build {

namespace check_options_detail {

/// @return what is wrong with a number, or nothing.
template <class Number> std::string fault(const char* name, Number value, Number least, Number most) {
  if (value >= least && value <= most) return {};
  std::ostringstream text;
  text << name << " is " << value << ", allowed are " << least << " to " << most;
  return text.str();
}

inline std::string builder_fault(Builder builder) {
  const bool embree = builder >= Builder::kEmbreeLow && builder <= Builder::kEmbreeHigh;
  if (embree && embree_version()[0] == '\0')
    return std::string("builder ") + name(builder) + " needs Embree, which this library was built without";
  if (builder >= Builder::kSah && builder <= Builder::kImported) return {};
  return "builder is " + std::to_string(static_cast<int>(builder)) + ", which is none of build::Builder";
}

}  // namespace check_options_detail

/// @tparam Options BuildOptions or gpu::BuildOptions.
/// @return kInvalidInput with the option, its value and its range.
template <class Options> Result<void> check_ranges(const Options& options) {
  using check_options_detail::fault, check_options_detail::builder_fault;
  const SahCosts& costs = options.costs;
  const double split_budget = options.split_budget.value_or(kSplitsAsNeeded);
  std::string faults[] = {
      builder_fault(options.builder),
      fault("max_leaf_triangles", options.max_leaf_triangles, 1u, 64u),
      split_budget == kSplitsAsNeeded ? "" : fault("split_budget", split_budget, 1.0, 16.0),
      fault("presplit_budget", options.presplit_budget, 1.0, 16.0),
      fault("ploc_radius", options.ploc_radius, 1u, 128u),
      fault("reinsertion_rounds", options.reinsertion_rounds.value_or(0), 0u, 1000u),
      options.widen_boxes && !may_be_widened(options.nodes) ? "widen_boxes needs node layout float or half" : "",
      costs.box_node > 0.0f && costs.leaf > 0.0f && costs.custom > 0.0f ? "" : "SAH costs must be positive",
      options.nodes >= NodeLayout::kFloat && options.nodes <= NodeLayout::kQuantized
          ? ""
          : "node layout " + std::to_string(static_cast<std::uint32_t>(options.nodes)) +
                " cannot be written; known are float, planes, half and quantized"};
  for (std::string& text : faults)
    if (!text.empty()) return tl::unexpected(Error{ErrorCode::kInvalidInput, std::move(text)});
  return {};
}

}  // namespace hiprt::build
