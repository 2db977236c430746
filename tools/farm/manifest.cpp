#include <tools/farm/manifest.h>

#include <tools/base/errors.h>
#include <tools/base/text.h>
#include <tools/cli/build/build_names.h>
#include <tools/scene_io/json_location.h>
#include <tools/scene_io/scene/scene_file.h>
#include <tools/scene_io/shapes/shape_import.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <unordered_map>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kFormatName = "hiprt assets";
constexpr std::uint32_t kKnownVersion = 1;
constexpr std::size_t kMostLevels = 4;  ///< The document, assets, an asset, its files.

void check_keys(const JsonLocation& location, const Json& object, const std::vector<std::string>& known) {
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    std::string words;
    for (const std::string& word : known) words += (words.empty() ? "" : ", ") + word;
    json_fault(location, "unknown key " + in_quotes(key) + "; known keys: " + words);
  }
}

std::string word_at(const JsonLocation& location, const Json& asset, const char* key,
                    const std::vector<std::string>& known) {
  const auto value = asset.find(key);
  if (value == asset.end()) return {};
  const JsonLocation at(location, key);
  const std::string& word = json_string(at, *value);
  if (std::find(known.begin(), known.end(), word) != known.end()) return word;
  std::string list;
  for (const std::string& one : known) list += (list.empty() ? "" : ", ") + one;
  json_fault(at, in_quotes(word) + " is unknown; expected one of " + list);
}

void add_file(const JsonLocation& location, const Json& value, const std::filesystem::path& folder, Asset& asset) {
  const std::string& file = json_string(location, value);
  if (file.empty()) json_fault(location, "the name of a file is empty");
  if (is_scene_file(file))
    json_fault(location, in_quotes(file) +
                             " is a scene; an asset has files of meshes and shapes. Build the scene by "
                             "bvhbuild SCENE --cache DIR");
  // operator/ keeps absolute paths.
  (is_shape_file(file) ? asset.shapes : asset.meshes).push_back((folder / file).string());
}

Asset asset_of(const JsonLocation& location, const Json& value, const std::filesystem::path& folder) {
  const Json& object = json_object(location, value);
  check_keys(location, object, {"name", "files", "quality", "builder", "target", "nodes"});
  Asset asset;
  const JsonLocation name_at(location, "name"), files_at(location, "files");
  asset.name = json_string(name_at, json_required(location, object, "name"));
  if (asset.name.empty()) json_fault(name_at, "the name is empty");
  const Json& files = json_array(files_at, json_required(location, object, "files"));
  if (files.empty()) json_fault(files_at, "there is no file in it; an asset has one or more");
  for (std::size_t i = 0; i < files.size(); ++i) add_file(JsonLocation(files_at, i), files[i], folder, asset);
  asset.quality = word_at(location, object, "quality", words(kQualities));
  asset.builder = word_at(location, object, "builder", words(kBuilders));
  asset.target = word_at(location, object, "target", words(kTargetLayouts));
  asset.nodes = word_at(location, object, "nodes", words(kLayouts, {"auto"}));
  if (!asset.quality.empty() && !asset.builder.empty()) json_fault(location, "has both 'quality' and 'builder'");
  return asset;
}

std::vector<Asset> assets_of(std::string_view text, const std::filesystem::path& folder) {
  const Json document = parse_json(text, kMostLevels);
  const JsonLocation root;
  json_object(root, document);
  check_keys(root, document, {"format", "version", "assets"});
  const JsonLocation format_at(root, "format"), version_at(root, "version"), assets_at(root, "assets");
  if (const std::string& format = json_string(format_at, json_required(root, document, "format"));
      format != kFormatName)
    json_fault(format_at, in_quotes(format) + "; expected 'hiprt assets'");
  if (const std::uint32_t version = json_uint32(version_at, json_required(root, document, "version"));
      version != kKnownVersion)
    json_fault(version_at, std::to_string(version) + "; this bvhbuild reads version 1");
  const Json& list = json_array(assets_at, json_required(root, document, "assets"));
  std::vector<Asset> result;
  std::unordered_map<std::string, std::size_t> names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const JsonLocation at(assets_at, i);
    result.push_back(asset_of(at, list[i], folder));
    if (const auto [first, is_new] = names.emplace(result.back().name, i); !is_new)
      json_fault(JsonLocation(at, "name"), in_quotes(result.back().name) + " is also the name of assets[" +
                                               std::to_string(first->second) + "]; names tell assets apart");
  }
  return result;
}

}  // namespace

BuildCommand Asset::command(const BuildCommand& defaults) const {
  BuildCommand result = defaults;
  if (!quality.empty()) result.quality = quality;
  if (!builder.empty()) {
    result.builder = builder;
    result.quality.clear();
  }
  // A target stands for its layout.
  if (!target.empty()) {
    result.target = target;
    result.nodes = "auto";
  }
  if (!nodes.empty()) result.nodes = nodes;
  return result;
}

build::Result<std::vector<Asset>> parse_manifest(std::string_view text, const std::string& path) {
  try {
    skip_byte_order_mark(text);
    return assets_of(text, std::filesystem::path(path).parent_path());
  } catch (const JsonFault& fault) {
    return invalid_input(path + ": " + fault.message);
  }
}

build::Result<void> measure_assets(std::vector<Asset>& assets, const std::string& path) {
  for (std::size_t i = 0; i < assets.size(); ++i) {
    for (const auto* files : {&assets[i].meshes, &assets[i].shapes})
      for (const std::string& file : *files) {
        std::error_code error;
        const auto size = std::filesystem::file_size(file, error);
        if (error)
          return fail(build::ErrorCode::kIo, path + ": assets[" + std::to_string(i) + "].files: cannot open " +
                                                 in_quotes(file) + ": " + error.message() +
                                                 "; relative names start at the folder of the manifest");
        assets[i].cost += static_cast<double>(size);
      }
  }
  return {};
}

}  // namespace hiprt::tools
