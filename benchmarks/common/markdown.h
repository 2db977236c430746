#pragma once
/// Markdown tables that are readable on a terminal too.

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::bench {

/// @return "1.234" for format_number(1.2341, 3).
std::string format_number(double value, int digits);

/// A table with padded columns. The first column is left-aligned, the others are right-aligned.
class MarkdownTable {
 public:
  explicit MarkdownTable(std::vector<std::string> head);

  /// @param row at most as many cells as the head. Missing cells stay empty.
  void add(std::vector<std::string> row);

  /// @return the table and an empty line.
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace hiprt::bench
