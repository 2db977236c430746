#pragma once
/// Figures of a tree as text and as JSON.

#include <hiprt_build/statistics.h>

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::tools {

/// Lines "label   value", labels in one column.
class Table {
 public:
  void row(std::string label, std::string value) { rows_.emplace_back(std::move(label), std::move(value)); }
  std::string text() const;

 private:
  std::vector<std::pair<std::string, std::string>> rows_;
};

/// @return @p value with @p digits digits after the decimal point.
std::string fixed(double value, int digits);
/// @return "1234567 (1.2 MiB)".
std::string bytes_text(std::uint64_t bytes);

/// Bytes of the file per triangle or custom primitive, or per instance of a scene of instances; 0 without any.
double bytes_per_primitive(const BufferView& view);
/// Adds a row with that number.
void add_bytes_per_primitive(Table& table, const BufferView& view);

/// Number of triangles or custom primitives, including dropped ones. 0 in a scene of instances: its objects have them.
std::uint64_t count_triangles(const BufferView& view);
std::uint64_t count_customs(const BufferView& view);

void add_tree(Table& table, const build::TreeStatistics& tree);
nlohmann::json tree_json(const build::TreeStatistics& tree);

}  // namespace hiprt::tools
