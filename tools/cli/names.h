#pragma once
/// Words for the command lines' choices: one table per choice.

#include <hiprt_build/build.h>

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hiprt::tools {

template <class Value, std::size_t N> using Names = std::array<std::pair<std::string_view, Value>, N>;

inline constexpr Names<build::Builder, 10> kBuilders{{{"sah", build::Builder::kSah},
                                                      {"lbvh", build::Builder::kLbvh},
                                                      {"lbvh30", build::Builder::kLbvh30},
                                                      {"ploc", build::Builder::kPloc},
                                                      {"hploc", build::Builder::kHploc},
                                                      {"sbvh", build::Builder::kSbvh},
                                                      {"hq", build::Builder::kHq},
                                                      {"embree-low", build::Builder::kEmbreeLow},
                                                      {"embree-medium", build::Builder::kEmbreeMedium},
                                                      {"embree-high", build::Builder::kEmbreeHigh}}};
inline constexpr Names<build::Quality, 3> kQualities{
    {{"fast", build::Quality::kFast}, {"balanced", build::Quality::kBalanced}, {"high", build::Quality::kHigh}}};
inline constexpr Names<NodeLayout, 4> kLayouts{{{"float", NodeLayout::kFloat},
                                                {"planes", NodeLayout::kPlanes},
                                                {"half", NodeLayout::kHalf},
                                                {"quantized", NodeLayout::kQuantized}}};
/// The layout that is traced fastest on each target.
inline constexpr Names<NodeLayout, 3> kTargetLayouts{
    {{"cpu", NodeLayout::kPlanes}, {"amd", NodeLayout::kFloat}, {"nvidia", NodeLayout::kPlanes}}};
/// @pre @p word is in the table (the command line was checked with words()).
template <class Value, std::size_t N> Value value_of(const Names<Value, N>& names, std::string_view word) {
  for (const auto& [name, value] : names)
    if (name == word) return value;
  return names.front().second;
}

template <class Value, std::size_t N> std::string word_of(const Names<Value, N>& names, Value wanted) {
  for (const auto& [name, value] : names)
    if (value == wanted) return std::string(name);
  return "unknown";
}

/// Every word of a table, and @p more.
template <class Value, std::size_t N>
std::vector<std::string> words(const Names<Value, N>& names, std::vector<std::string> more = {}) {
  for (const auto& [name, value] : names) more.emplace_back(name);
  return more;
}

}  // namespace hiprt::tools
