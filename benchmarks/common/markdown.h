#pragma once
/// Markdown tables of the figures. on a terminal and in summary.md.

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::bench {

/// @return "1.234" for format_number(1.2341, 3).
std::string format_number(double value, int digits);

/// A table whose columns are padded, so that it can be read as text too. The first column is left-aligned, the others
/// right-aligned.
class MarkdownTable {
 public:
  explicit MarkdownTable(std::vector<std::string> head);

  /// @param row as many cells as the head, or fewer: the rest stays empty.
  void add(std::vector<std::string> row);

  /// The table and an empty line.
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace hiprt::bench
