#pragma once
/// Tables and texts of the programs' summaries.

#include "markdown.h"

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

/// A column of table().
template <class Row> struct Column {
  std::string head;
  std::function<std::string(const Row&)> cell;
};

/// A table with one line per row.
template <class Row> std::string table(const std::vector<Row>& rows, const std::vector<Column<Row>>& columns) {
  std::vector<std::string> head;
  head.reserve(columns.size());
  for (const Column<Row>& column : columns) head.push_back(column.head);
  MarkdownTable result(head);
  for (const Row& row : rows) {
    std::vector<std::string> cells;
    cells.reserve(columns.size());
    for (const Column<Row>& column : columns) cells.push_back(column.cell(row));
    result.add(std::move(cells));
  }
  return result.text();
}

/// A table of @p rows by @p columns. Rows without any text are left out.
/// @param corner head of the column that has the rows' names.
std::string cross_table(const std::string& corner, const std::vector<std::string>& rows,
                        const std::vector<std::string>& columns,
                        const std::function<std::string(const std::string& row, const std::string& column)>& cell);

/// @return "-" for NaN, else as format_number().
std::string number_or_dash(double value, int digits);
/// @return "1.23 (0.456)": a value, and its ratio to the reference.
std::string with_ratio(double value, int digits, double ratio, int ratio_digits);
/// @return "1 thread", "8 threads".
std::string threads_text(unsigned threads);
/// How the programs repeat their measurements, as the end of a sentence.
std::string rounds_text(unsigned rounds);
/// A heading with the scene's name and number of triangles.
std::string scene_heading(const std::string& scene, std::uint64_t triangles);

}  // namespace hiprt::bench
