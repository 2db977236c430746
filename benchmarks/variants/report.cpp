#include "report.h"

#include "../common/markdown.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

namespace hiprt::bench {
namespace {

/// @return the values of all axes except the query, which the column shows, and answers by id.
std::string row_name(const VariantName& name) {
  const std::string_view order = has_usual_order(name) ? "usual" : name.order;
  std::string text;
  for (const std::string_view part :
       {name.layout, name.tests, name.stack, name.schedule, order, name.features, name.blocks})
    text += (text.empty() ? "" : " ") + std::string(part);
  if (name.answers != "id") text += " " + std::string(name.answers);
  return text;
}

/// @return the kind of rays, and the query if the kind does not imply it.
std::string column_name(const Variant& variant, const Result& result) {
  return result.kind + (variant.query == Query::kAll ? " all" : "");
}

std::string hexadecimal(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(value));
  return text;
}

double bytes_per_primitive(const TreeRecord& tree) {
  return tree.primitives == 0 ? 0 : static_cast<double>(tree.bytes) / static_cast<double>(tree.primitives);
}

/// A row of a tree's table: registers, occupancy, and a speed per kind.
struct Row {
  std::string registers, occupancy;
  std::map<std::string, std::string> speeds;
};

void add_part(std::string& text, const std::string& part) {
  if (text.find(part) == std::string::npos) text += (text.empty() ? "" : "/") + part;
}

std::string speed_text(const Result& result) {
  if (result.repetitions == 0) return "failed";
  std::string text = format_number(result.mrays_s, result.mrays_s < 100 ? 2 : 0);
  if (result.overflowed != 0) text += "!";
  return text;
}

std::string table_of(const Engine& engine, const Report& report, std::size_t tree) {
  std::vector<std::string> kinds, order;
  std::map<std::string, Row> rows;
  for (const Result& result : report.results) {
    if (result.tree != tree) continue;
    const Variant& variant = engine.variants()[result.variant];
    const std::string name = row_name(variant.name);
    if (!rows.contains(name)) order.push_back(name);
    Row& row = rows[name];
    add_part(row.registers, std::to_string(variant.resources.registers));
    add_part(row.occupancy, format_number(100 * variant.resources.occupancy, 0));
    const std::string kind = column_name(variant, result);
    row.speeds[kind] = speed_text(result);
    if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) kinds.push_back(kind);
  }
  std::vector<std::string> head{"variant", "registers", "occupancy %"};
  head.insert(head.end(), kinds.begin(), kinds.end());
  MarkdownTable table(head);
  for (const std::string& name : order) {
    const Row& row = rows[name];
    std::vector<std::string> cells{name, row.registers, row.occupancy};
    for (const std::string& kind : kinds) cells.push_back(row.speeds.contains(kind) ? row.speeds.at(kind) : "");
    table.add(std::move(cells));
  }
  return table.text();
}

/// @return the table of tests that are not exact (is_exact()). It shows the share of compared rays that hit other
/// primitives than on the host, over all variants with the same tests.
std::string inexact_text(const Engine& engine, const Report& report) {
  struct Sum {
    std::uint64_t checked = 0, other_primitives = 0;
  };
  std::vector<std::array<std::string, 3>> order;
  std::map<std::array<std::string, 3>, Sum> sums;
  for (const Result& result : report.results) {
    const Variant& variant = engine.variants()[result.variant];
    if (is_exact(variant.name)) continue;
    const TreeRecord& tree = report.trees[result.tree];
    const std::array<std::string, 3> key{tree.scene + "." + tree.name, column_name(variant, result),
                                         std::string(variant.name.tests)};
    if (!sums.contains(key)) order.push_back(key);
    Sum& sum = sums[key];
    sum.checked += result.checked;
    sum.other_primitives += result.other_primitives;
  }
  if (order.empty()) return {};
  MarkdownTable table({"tree", "kind", "tests", "rays compared", "other primitives %"});
  for (const auto& key : order) {
    const Sum& sum = sums[key];
    const auto checked = static_cast<double>(std::max<std::uint64_t>(1, sum.checked));
    const double percent = 100 * static_cast<double>(sum.other_primitives) / checked;
    table.add({key[0], key[1], key[2], std::to_string(sum.checked), format_number(percent, 3)});
  }
  return "## Tests that are not exact: rays that hit other primitives than on the host\n\n" + table.text();
}

nlohmann::json tree_json(const TreeRecord& tree) {
  nlohmann::json provenance = nlohmann::json::parse(tree.provenance, nullptr, false);
  if (provenance.is_discarded()) provenance = tree.provenance;
  return {{"scene", tree.scene},
          {"tree", tree.name},
          {"path", tree.path},
          {"layout", tree.layout},
          {"bytes", tree.bytes},
          {"primitives", tree.primitives},
          {"bytes_per_triangle", bytes_per_primitive(tree)},
          {"nodes", tree.nodes},
          {"leaves", tree.leaves},
          {"stack_bound", tree.stack_bound},
          {"features", tree.features},
          {"provenance", std::move(provenance)}};
}

nlohmann::json resources_json(const Resources& resources) {
  return {{"registers", resources.registers},
          {"local_bytes", resources.local_bytes},
          {"shared_bytes", resources.shared_bytes},
          {"resident_threads", resources.resident_threads},
          {"occupancy", resources.occupancy}};
}

nlohmann::json result_json(const Variant& variant, const TreeRecord& tree, const Result& result) {
  nlohmann::json json{{"scene", tree.scene},
                      {"tree", tree.name},
                      {"kind", result.kind},
                      {"rays", result.rays},
                      {"ray_order", result.ray_order},
                      {"mrays_s", result.mrays_s},
                      {"repetitions", result.repetitions},
                      {"min_ms", result.min_ms},
                      {"median_ms", result.median_ms},
                      {"max_ms", result.max_ms},
                      {"checksum", hexadecimal(result.checksum)},
                      {"hits", result.hits},
                      {"overflowed_rays", result.overflowed},
                      {"checked_rays", result.checked},
                      {"wrong_rays", result.wrong},
                      {"other_primitive_rays", result.other_primitives},
                      {"problem", result.problem}};
  for (const Axis& axis : kAxes) json[std::string(axis.key)] = variant.name.*axis.value;
  json.update(resources_json(variant.resources));
  return json;
}

}  // namespace

std::string list_text(const Engine& engine, const std::vector<std::vector<std::string>>& values) {
  constexpr std::size_t kColumns = kAxes.size() + 5;
  std::vector<std::string> head;
  head.reserve(kColumns);
  for (const Axis& axis : kAxes) head.emplace_back(axis.key);
  for (const char* name : {"registers", "local B", "shared B", "threads", "occupancy %"}) head.emplace_back(name);
  MarkdownTable table(head);
  for (const Variant& variant : engine.variants()) {
    if (!is_wanted(variant.name, values)) continue;
    std::vector<std::string> row;
    row.reserve(kColumns);
    for (const Axis& axis : kAxes) row.emplace_back(variant.name.*axis.value);
    const Resources& resources = variant.resources;
    for (const std::uint64_t number : {std::uint64_t{resources.registers}, resources.local_bytes,
                                       resources.shared_bytes, std::uint64_t{resources.resident_threads}})
      row.push_back(std::to_string(number));
    row.push_back(format_number(100 * resources.occupancy, 0));
    table.add(std::move(row));
  }
  return table.text();
}

std::string tables(const Engine& engine, const Report& report) {
  std::string text;
  for (std::size_t i = 0; i < report.trees.size(); ++i) {
    const TreeRecord& tree = report.trees[i];
    text += "## " + tree.scene + "." + tree.name + ": " + tree.layout + ", " +
            format_number(bytes_per_primitive(tree), 1) + " bytes per triangle, Mrays/s\n\n";
    text += table_of(engine, report, i);
  }
  text += "`!`: rays whose stack was too small have no result.\n\n";
  return text + inexact_text(engine, report);
}

nlohmann::json to_json(const Engine& engine, const Report& report, const nlohmann::json& context) {
  nlohmann::json json = context;
  json["format"] = "hiprt bench_variants 1";
  json["device"] = engine.describe();
  for (const TreeRecord& tree : report.trees) json["trees"].push_back(tree_json(tree));
  for (const Result& result : report.results)
    json["results"].push_back(result_json(engine.variants()[result.variant], report.trees[result.tree], result));
  json["faults"] = report.faults;
  return json;
}

}  // namespace hiprt::bench
