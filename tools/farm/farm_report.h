#pragma once
/// What became of the assets of a manifest.

#include <tools/distributed/ranks.h>
#include <tools/farm/manifest.h>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace hiprt::tools {

/// What a rank says of an asset; it travels as JSON.
struct AssetResult {
  std::string state = "waiting";  ///< "hit", "miss", "damaged" (built again), "failed", "lost" or "waiting".
  std::string key{}, file{};
  std::string error{};  ///< Of a failed asset.
  std::vector<std::string> warnings{};
  std::uint64_t bytes = 0, triangles = 0, customs = 0;
  std::uint64_t builder_bytes = 0, process_bytes = 0;  ///< Peaks of memory.
  double read_seconds = 0, build_seconds = 0;          ///< Building includes looking into the cache and writing.
  int rank = -1;

  bool is_done() const { return state == "hit" || state == "miss" || state == "damaged"; }
};

std::vector<std::byte> packed(const AssetResult& result);
build::Result<AssetResult> unpacked(std::span<const std::byte> bytes);

struct FarmReport {
  std::vector<AssetResult> assets;
  std::vector<int> lost_ranks;
  double seconds = 0;

  std::size_t count(const std::string& state) const;
  /// "2 of 10 assets failed; the first is 'tree': ..." Empty: all are done.
  std::string fault(const std::vector<Asset>& manifest) const;
};

nlohmann::json report_json(const FarmReport& report, const std::vector<Asset>& manifest, const Ranks& ranks);
std::string report_text(const FarmReport& report, const std::vector<Asset>& manifest, const Ranks& ranks);

}  // namespace hiprt::tools
