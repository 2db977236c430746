#include <tools/cli/report.h>

#include <hiprt_build/format/view.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdio>

namespace hiprt::tools {

std::string Table::text() const {
  std::size_t width = 0;
  for (const auto& [label, value] : rows_) width = std::max(width, label.size());
  std::string text;
  for (const auto& [label, value] : rows_) text += label + std::string(width - label.size() + 2, ' ') + value + "\n";
  return text;
}

std::string fixed(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

std::string bytes_text(std::uint64_t bytes) {
  return std::to_string(bytes) + " (" + fixed(static_cast<double>(bytes) / (1024.0 * 1024.0), 1) + " MiB)";
}

double bytes_per_primitive(const BufferView& view) {
  const std::uint64_t primitives = view.header->primitive_count;
  return primitives == 0 ? 0.0 : static_cast<double>(view.bytes.size()) / static_cast<double>(primitives);
}

void add_bytes_per_primitive(Table& table, const BufferView& view) {
  const char* label = view.has_instances()       ? "bytes per instance"
                      : count_customs(view) == 0 ? "bytes per triangle"
                                                 : "bytes per primitive";
  table.row(label, fixed(bytes_per_primitive(view), 1));
}

std::uint64_t count_triangles(const BufferView& view) {
  return view.has_instances() ? 0 : view.header->primitive_count - count_customs(view);
}

std::uint64_t count_customs(const BufferView& view) {
  if (view.has_instances()) return 0;
  std::uint64_t sum = 0;
  for (const GeometryRecord& geometry : view.geometries)
    if ((geometry.flags & kGeometryCustom) != 0) sum += geometry.primitive_count;
  return sum;
}

void add_tree(Table& table, const build::TreeStatistics& tree) {
  table.row("nodes", std::to_string(tree.nodes));
  table.row("leaves", std::to_string(tree.leaves) + " in " + std::to_string(tree.leaf_runs) + " runs");
  table.row("triangles in leaves", std::to_string(tree.leaf_triangles));
  if (tree.custom_leaves != 0)
    table.row("custom leaves",
              std::to_string(tree.custom_leaves) + " with " + std::to_string(tree.leaf_customs) + " primitives");
  table.row("depth", std::to_string(tree.depth));
  table.row("fill of nodes", fixed(100 * tree.fill, 1) + " %");
  table.row("fill of leaves", fixed(100 * tree.pair_fill, 1) + " %");
  table.row("SAH cost", fixed(tree.sah_cost, 3));
  table.row("sibling overlap", fixed(tree.sibling_overlap, 4));
  table.row("exchange slack", fixed(tree.exchange_slack, 4));
}

nlohmann::json tree_json(const build::TreeStatistics& tree) {
  return {{"nodes", tree.nodes},
          {"leaves", tree.leaves},
          {"leaf_runs", tree.leaf_runs},
          {"leaf_triangles", tree.leaf_triangles},
          {"custom_leaves", tree.custom_leaves},
          {"leaf_customs", tree.leaf_customs},
          {"nodes_by_children", tree.nodes_by_children},
          {"depth", tree.depth},
          {"fill", tree.fill},
          {"pair_fill", tree.pair_fill},
          {"sah_cost", tree.sah_cost},
          {"sibling_overlap", tree.sibling_overlap},
          {"exchange_slack", tree.exchange_slack}};
}

}  // namespace hiprt::tools
