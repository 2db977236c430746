#include <hiprt_build/src/provenance.h>

#include <nlohmann/json.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cstdio>
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

}  // namespace

std::string make_provenance(Monitor& monitor, const SceneInput& scene, const BuildOptions& options, unsigned rounds,
                            const BuildStatistics& statistics, double sah_cost) {
  using Json = nlohmann::ordered_json;
  Json geometries = Json::array();
  for (const TriangleMesh& mesh : scene.meshes)
    geometries.push_back({{"name", std::string(mesh.name)},
                          {"vertices", mesh.positions.size()},
                          {"triangles", mesh.triangles.size()},
                          {"xxh3", hash(monitor, mesh.positions, mesh.triangles, std::span(&mesh.mask, 1))}});
  for (const CustomGeometry& custom : scene.customs)
    geometries.push_back({{"name", std::string(custom.name)},
                          {"customs", custom.boxes.size()},
                          {"type", custom.type},
                          {"xxh3", hash(monitor, custom.boxes, std::span(&custom.mask, 1))}});
  const Json document = {{"tool", options.tool.empty() ? "hiprt_build" : std::string(options.tool)},
                         {"library", std::string("hiprt ") + version()},
                         {"builder", name(options.builder)},
                         {"options",
                          {{"nodes", layout_name(options.nodes)},
                           {"max_leaf_triangles", options.max_leaf_triangles},
                           {"split_budget", options.split_budget},
                           {"reinsertion_rounds", rounds},
                           {"ploc_radius", options.ploc_radius},
                           {"pair_triangles", options.pair_triangles},
                           {"cost_box_node", options.costs.box_node},
                           {"cost_leaf", options.costs.leaf},
                           {"cost_custom", options.costs.custom}}},
                         {"input", geometries},
                         {"statistics",
                          {{"builder", name(statistics.builder)},
                           {"triangles", statistics.triangles},
                           {"customs", statistics.customs},
                           {"dropped_not_finite", statistics.dropped_not_finite},
                           {"dropped_degenerate", statistics.dropped_degenerate},
                           {"pairs", statistics.pairs},
                           {"custom_pairs", statistics.custom_pairs},
                           {"nodes", statistics.nodes},
                           {"leaves", statistics.leaves},
                           {"sah_cost", sah_cost}}}};
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace hiprt::build
