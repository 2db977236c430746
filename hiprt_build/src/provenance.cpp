#include <hiprt_build/src/provenance.h>

#include <nlohmann/json.hpp>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstdio>

namespace hiprt::build {
namespace {

/// XXH3-64 of positions, then triangles, then mask, as 16 hexadecimal digits.
std::string hash(const TriangleMesh& mesh) {
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, mesh.positions.data(), mesh.positions.size_bytes());
  XXH3_64bits_update(&state, mesh.triangles.data(), mesh.triangles.size_bytes());
  XXH3_64bits_update(&state, &mesh.mask, sizeof(mesh.mask));
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(XXH3_64bits_digest(&state)));
  return text;
}

const char* layout_name(NodeLayout layout) {
  constexpr const char* kNames[] = {"float", "planes", "half", "quantized"};
  return kNames[static_cast<std::uint32_t>(layout) - 1];
}

}  // namespace

std::string make_provenance(std::span<const TriangleMesh> meshes, const BuildOptions& options,
                            const BuildStatistics& statistics, double sah_cost) {
  using Json = nlohmann::ordered_json;
  Json geometries = Json::array();
  for (const TriangleMesh& mesh : meshes)
    geometries.push_back({{"name", std::string(mesh.name)},
                          {"vertices", mesh.positions.size()},
                          {"triangles", mesh.triangles.size()},
                          {"xxh3", hash(mesh)}});
  const Json document = {{"tool", options.tool.empty() ? "hiprt_build" : std::string(options.tool)},
                         {"library", std::string("hiprt ") + version()},
                         {"builder", name(options.builder)},
                         {"options",
                          {{"nodes", layout_name(options.nodes)},
                           {"max_leaf_triangles", options.max_leaf_triangles},
                           {"pair_triangles", options.pair_triangles},
                           {"cost_box_node", options.costs.box_node},
                           {"cost_leaf", options.costs.leaf}}},
                         {"input", geometries},
                         {"statistics",
                          {{"builder", name(statistics.builder)},
                           {"triangles", statistics.triangles},
                           {"dropped_not_finite", statistics.dropped_not_finite},
                           {"dropped_degenerate", statistics.dropped_degenerate},
                           {"pairs", statistics.pairs},
                           {"nodes", statistics.nodes},
                           {"leaves", statistics.leaves},
                           {"sah_cost", sah_cost}}}};
  return document.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace hiprt::build
