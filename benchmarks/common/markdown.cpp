#include "markdown.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace hiprt::bench {

std::string format_number(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

MarkdownTable::MarkdownTable(std::vector<std::string> head) { rows_.push_back(std::move(head)); }

void MarkdownTable::add(std::vector<std::string> row) {
  row.resize(rows_.front().size());
  rows_.push_back(std::move(row));
}

std::string MarkdownTable::text() const {
  std::vector<std::size_t> width(rows_.front().size(), 3);
  for (const auto& row : rows_)
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  std::string text;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < width.size(); ++c) {
      const std::string padding(width[c] - rows_[r][c].size(), ' ');
      text += "| " + (c == 0 ? rows_[r][c] + padding : padding + rows_[r][c]) + " ";
    }
    text += "|\n";
    if (r != 0) continue;
    for (std::size_t c = 0; c < width.size(); ++c) text += "|" + std::string(width[c] + 1, '-') + (c == 0 ? "-" : ":");
    text += "|\n";
  }
  return text + "\n";
}

}  // namespace hiprt::bench
