#include <hiprt_build/input/provenance.h>

#include <hiprt_build/input/build_input.h>

#include <nlohmann/json.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>

namespace hiprt::build {
namespace {

/// XXH3-64 of all the bytes, one span after the other, as 16 hexadecimal digits.
template <class... Spans> std::string hash(Monitor& monitor, const Spans&... spans) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  const auto update = [&](std::span<const std::byte> bytes) {
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(kPiece, bytes.size()))) {
      monitor.check();
      XXH3_64bits_update(&state, bytes.data(), std::min(kPiece, bytes.size()));
    }
  };
  (update(std::as_bytes(spans)), ...);
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(XXH3_64bits_digest(&state)));
  return text;
}

const char* layout_name(NodeLayout layout) {
  constexpr const char* kNames[] = {"float", "planes", "half", "quantized"};
  return kNames[static_cast<std::uint32_t>(layout) - 1];
}

/// document[group][key] if it is a finite number.
std::optional<double> number(const nlohmann::json& document, const char* group, const char* key) {
  if (!document.is_object() || !document.contains(group)) return std::nullopt;
  const nlohmann::json& values = document[group];
  if (!values.is_object() || !values.contains(key) || !values[key].is_number()) return std::nullopt;
  const auto value = values[key].get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

using Json = nlohmann::ordered_json;

/// The elements without the gaps between them, so that the hash does not depend on strides.
template <class T, class View> std::span<const T> packed(const View& elements, std::vector<T>& copy) {
  if (!elements.has_gaps()) return {static_cast<const T*>(elements.data()), elements.size()};
  copy.resize(elements.size());
  for (std::size_t i = 0; i < copy.size(); ++i) copy[i] = elements[i];
  return copy;
}

std::string hash_of(Monitor& monitor, const TriangleMesh& mesh) {
  std::vector<Position> positions;
  std::vector<Triangle> triangles;
  return hash(monitor, packed(mesh.positions, positions), packed(mesh.triangles, triangles), std::span(&mesh.mask, 1));
}

std::string hash_of(Monitor& monitor, const CustomGeometry& custom) {
  std::vector<Box> boxes;
  return hash(monitor, packed(custom.boxes, boxes), std::span(&custom.mask, 1), custom.shapes.points,
              custom.shapes.segments);
}

Json describe_input(Monitor& monitor, const SceneInput& scene) {
  Json geometries = Json::array();
  for (const TriangleMesh& mesh : scene.meshes)
    geometries.push_back({{"name", std::string(mesh.name)},
                          {"vertices", mesh.positions.size()},
                          {"triangles", triangle_count(mesh)},
                          {"xxh3", hash_of(monitor, mesh)}});
  for (const CustomGeometry& custom : scene.customs)
    geometries.push_back({{"name", std::string(custom.name)},
                          {"customs", custom.boxes.size()},
                          {"type", custom.type},
                          {"xxh3", hash_of(monitor, custom)}});
  return geometries;
}

/// @param options nothing unset.
Json describe_options(const BuildOptions& options) {
  return {{"nodes", layout_name(options.nodes)},
          {"max_leaf_triangles", options.max_leaf_triangles},
          {"presplit_budget", options.presplit_budget},
          {"split_budget", options.split_budget.value()},
          {"reinsertion_rounds", options.reinsertion_rounds.value()},
          {"ploc_radius", options.ploc_radius},
          {"pair_triangles", options.pair_triangles},
          {"widen_boxes", options.widen_boxes},
          {"cost_box_node", options.costs.box_node},
          {"cost_leaf", options.costs.leaf},
          {"cost_custom", options.costs.custom}};
}

Json describe_statistics(const BuildStatistics& statistics, double sah_cost) {
  return {{"builder", name(statistics.builder)},
          {"triangles", statistics.triangles},
          {"customs", statistics.customs},
          {"dropped_not_finite", statistics.dropped_not_finite},
          {"dropped_degenerate", statistics.dropped_degenerate},
          {"pairs", statistics.pairs},
          {"custom_pairs", statistics.custom_pairs},
          {"nodes", statistics.nodes},
          {"leaves", statistics.leaves},
          {"sah_cost", sah_cost}};
}

}  // namespace

std::string make_provenance(Monitor& monitor, const SceneInput& scene, const BuildOptions& options,
                            const BuildStatistics& statistics, double sah_cost) {
  const Json document = {{"tool", options.tool.empty() ? "hiprt_build" : std::string(options.tool)},
                         {"library", std::string("hiprt ") + version()},
                         {"builder", name(options.builder)},
                         {"options", describe_options(options)},
                         {"input", describe_input(monitor, scene)},
                         {"statistics", describe_statistics(statistics, sah_cost)}};
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  // The last of the statistics, in a fixed number of digits.
  return text.replace(text.size() - 2, 2, ",\"exchange_slack\":0.000000}}");
}

void set_exchange_slack(std::span<char> provenance, double exchange_slack) {
  char text[16];
  const int size = std::snprintf(text, sizeof(text), "%.6f}}", exchange_slack);
  std::copy_n(text, size, provenance.end() - size);
}

BuiltTree read_built_tree(std::string_view provenance) {
  const nlohmann::json document = nlohmann::json::parse(provenance, nullptr, false);
  BuiltTree result;
  const auto read = [&](const char* key, float& cost) {
    const double value = number(document, "options", key).value_or(0);
    if (value > 0 && value <= static_cast<double>(std::numeric_limits<float>::max())) cost = static_cast<float>(value);
  };
  read("cost_box_node", result.costs.box_node);
  read("cost_leaf", result.costs.leaf);
  read("cost_custom", result.costs.custom);
  result.sah_cost = number(document, "statistics", "sah_cost");
  if (!(result.sah_cost > 0.0)) result.sah_cost.reset();
  result.exchange_slack = number(document, "statistics", "exchange_slack");
  if (!(result.exchange_slack >= 0.0 && result.exchange_slack <= 1.0)) result.exchange_slack.reset();
  return result;
}

}  // namespace hiprt::build
