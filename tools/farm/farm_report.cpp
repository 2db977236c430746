#include <tools/farm/farm_report.h>

#include <tools/base/errors.h>
#include <tools/cli/report.h>

#include <algorithm>
#include <array>
#include <cstdio>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

}  // namespace

std::vector<std::byte> packed(const AssetResult& result) {
  const Json json{{"state", result.state},
                  {"key", result.key},
                  {"file", result.file},
                  {"error", result.error},
                  {"warnings", result.warnings},
                  {"bytes", result.bytes},
                  {"triangles", result.triangles},
                  {"customs", result.customs},
                  {"builder_bytes", result.builder_bytes},
                  {"process_bytes", result.process_bytes},
                  {"read_seconds", result.read_seconds},
                  {"build_seconds", result.build_seconds}};
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

build::Result<AssetResult> unpacked(std::span<const std::byte> bytes) {
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  try {
    const Json json = Json::parse(text, text + bytes.size());
    AssetResult result;
    json.at("state").get_to(result.state);
    json.at("key").get_to(result.key);
    json.at("file").get_to(result.file);
    json.at("error").get_to(result.error);
    json.at("warnings").get_to(result.warnings);
    json.at("bytes").get_to(result.bytes);
    json.at("triangles").get_to(result.triangles);
    json.at("customs").get_to(result.customs);
    json.at("builder_bytes").get_to(result.builder_bytes);
    json.at("process_bytes").get_to(result.process_bytes);
    json.at("read_seconds").get_to(result.read_seconds);
    json.at("build_seconds").get_to(result.build_seconds);
    return result;
  } catch (const Json::exception& error) {
    return fail(build::ErrorCode::kBackend, std::string("a rank sent a result that is damaged: ") + error.what());
  }
}

std::size_t FarmReport::count(const std::string& state) const {
  return static_cast<std::size_t>(
      std::count_if(assets.begin(), assets.end(), [&](const AssetResult& asset) { return asset.state == state; }));
}

std::string FarmReport::fault(const std::vector<Asset>& manifest) const {
  std::string first;
  std::size_t faults = 0;
  for (std::size_t i = 0; i < assets.size(); ++i) {
    if (assets[i].is_done()) continue;
    if (++faults > 1) continue;
    first = "'" + manifest[i].name + "': ";
    first += assets[i].state == "failed" ? assets[i].error
             : assets[i].state == "lost" ? "its rank was lost"
                                         : "the run ended before it was built";
  }
  if (faults == 0) return {};
  return std::to_string(faults) + " of " + std::to_string(assets.size()) +
         " assets were not built. Start it again to build them; the others are in the cache. The first is " + first;
}

Json report_json(const FarmReport& report, const std::vector<Asset>& manifest, const Ranks& ranks) {
  Json assets = Json::array();
  for (std::size_t i = 0; i < manifest.size(); ++i) {
    const AssetResult& result = report.assets[i];
    Json asset{{"name", manifest[i].name}, {"state", result.state}};
    if (result.rank >= 0) asset["rank"] = result.rank;
    if (!result.error.empty()) asset["error"] = result.error;
    if (result.is_done())
      asset.update({{"file", result.file},
                    {"key", result.key},
                    {"bytes", result.bytes},
                    {"triangles", result.triangles},
                    {"customs", result.customs},
                    {"seconds", {{"read", result.read_seconds}, {"build", result.build_seconds}}},
                    {"peak_bytes", {{"builder", result.builder_bytes}, {"process", result.process_bytes}}}});
    assets.push_back(std::move(asset));
  }
  Json lost = Json::array();
  for (const int rank : report.lost_ranks) lost.push_back(ranks.name(rank));
  return {{"assets", std::move(assets)},        {"complete", report.fault(manifest).empty()},
          {"hits", report.count("hit")},        {"misses", report.count("miss")},
          {"damaged", report.count("damaged")}, {"failed", report.count("failed")},
          {"lost", report.count("lost")},       {"ranks", ranks.size()},
          {"lost_ranks", std::move(lost)},      {"seconds", report.seconds}};
}

std::string report_text(const FarmReport& report, const std::vector<Asset>& manifest, const Ranks& ranks) {
  std::string text;
  for (std::size_t i = 0; i < manifest.size(); ++i) {
    const AssetResult& result = report.assets[i];
    std::array<char, 128> figures{};
    std::snprintf(figures.data(), figures.size(), "%-8s rank %-4d %9.3f s  %10llu bytes  ", result.state.c_str(),
                  result.rank, result.read_seconds + result.build_seconds,
                  static_cast<unsigned long long>(result.bytes));
    text += figures.data() + manifest[i].name + (result.is_done() ? "  " + result.file : "") + "\n";
  }
  Table table;
  table.row("assets", std::to_string(manifest.size()));
  for (const char* state : {"hit", "miss", "damaged", "failed", "lost", "waiting"})
    table.row(state, std::to_string(report.count(state)));
  table.row("ranks", std::to_string(ranks.size()) + ", lost: " + std::to_string(report.lost_ranks.size()));
  table.row("time", fixed(report.seconds, 3) + " s");
  return text + table.text();
}

}  // namespace hiprt::tools
