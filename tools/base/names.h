#pragma once
/// Tables of words and the values that they stand for: choices of command lines and of JSON documents.

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hiprt::tools {

template <class Value, std::size_t N> using Names = std::array<std::pair<std::string_view, Value>, N>;

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

/// @return @p more, then every word of the table.
template <class Value, std::size_t N>
std::vector<std::string> words(const Names<Value, N>& names, std::vector<std::string> more = {}) {
  for (const auto& [name, value] : names) more.emplace_back(name);
  return more;
}

}  // namespace hiprt::tools
