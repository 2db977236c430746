#include "summary.h"

#include <algorithm>
#include <cmath>

namespace hiprt::bench {

std::string cross_table(const std::string& corner, const std::vector<std::string>& rows,
                        const std::vector<std::string>& columns,
                        const std::function<std::string(const std::string&, const std::string&)>& cell) {
  std::vector<std::string> head{corner};
  head.insert(head.end(), columns.begin(), columns.end());
  MarkdownTable result(head);
  for (const std::string& row : rows) {
    std::vector<std::string> line{row};
    for (const std::string& column : columns) line.push_back(cell(row, column));
    if (std::any_of(line.begin() + 1, line.end(), [](const std::string& text) { return !text.empty(); }))
      result.add(std::move(line));
  }
  return result.text();
}

std::string number_or_dash(double value, int digits) { return std::isnan(value) ? "-" : format_number(value, digits); }

std::string with_ratio(double value, int digits, double ratio, int ratio_digits) {
  return format_number(value, digits) + " (" + format_number(ratio, ratio_digits) + ")";
}

std::string threads_text(unsigned threads) { return std::to_string(threads) + (threads == 1 ? " thread" : " threads"); }

std::string rounds_text(unsigned rounds) {
  return std::to_string(rounds) + " round(s) in turn; medians over the rounds.";
}

std::string scene_heading(const std::string& scene, std::uint64_t triangles) {
  return "### " + scene + ", " + std::to_string(triangles) + " triangles";
}

}  // namespace hiprt::bench
