#include <tools/parts/part_manifest.h>

#include <tools/base/errors.h>
#include <tools/base/text.h>
#include <tools/scene_io/json_location.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kFormatName = "hiprt parts";
constexpr std::uint32_t kManifestVersion = 1;
constexpr std::size_t kMostLevels = 5;  ///< The document, parts, a part, its boxes, a box.
constexpr std::size_t kDigits = 32;     ///< Of a checksum.

/// A whole number up to 2^53, which doubles hold exactly.
std::uint64_t count_at(const JsonLocation& outer, const Json& object, const char* key) {
  const JsonLocation location(outer, key);
  const double number = json_number(location, json_required(outer, object, key));
  if (!(number >= 0.0 && number <= 0x1p53) || number != std::floor(number))
    json_fault(location, "it is no whole number from 0 to 2^53");
  return static_cast<std::uint64_t>(number);
}

float float_at(const JsonLocation& location, double number) {
  if (!(std::abs(number) <= static_cast<double>(std::numeric_limits<float>::max())))
    json_fault(location, "a number does not fit into a float");
  return static_cast<float>(number);
}

Box box_at(const JsonLocation& location, const Json& value) {
  const auto numbers = json_numbers<6>(location, value);
  Box box{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    box.min[axis] = float_at(location, numbers[axis]);
    box.max[axis] = float_at(location, numbers[axis + 3]);
    if (box.min[axis] > box.max[axis]) json_fault(location, "a minimum is above its maximum");
  }
  return box;
}

PartFile file_at(const JsonLocation& outer, const Json& part, const char* key) {
  const JsonLocation location(outer, key);
  const Json& value = json_object(location, json_required(outer, part, key));
  const JsonLocation name_at(location, "name"), sum_at(location, "xxh3");
  PartFile file{json_string(name_at, json_required(location, value, "name")), count_at(location, value, "bytes"),
                json_string(sum_at, json_required(location, value, "xxh3"))};
  if (file.name.empty()) json_fault(name_at, "the name of a file is empty");
  const auto is_digit = [](unsigned char c) { return std::isxdigit(c) != 0; };
  if (file.checksum.size() != kDigits || !std::all_of(file.checksum.begin(), file.checksum.end(), is_digit))
    json_fault(sum_at, in_quotes(file.checksum) + " is no checksum of 32 hexadecimal digits");
  return file;
}

ScenePart part_at(const JsonLocation& location, const Json& value) {
  const Json& object = json_object(location, value);
  ScenePart part;
  part.bvh = file_at(location, object, "bvh");
  part.data = file_at(location, object, "data");
  part.instances = count_at(location, object, "instances");
  const JsonLocation bounds_at(location, "bounds"), boxes_at(location, "boxes"), condition_at(location, "condition"),
      reach_at(location, "reach");
  part.bounds = box_at(bounds_at, json_required(location, object, "bounds"));
  part.condition = float_at(condition_at, json_number(condition_at, json_required(location, object, "condition")));
  part.reach = float_at(reach_at, json_number(reach_at, json_required(location, object, "reach")));
  if (part.condition < 0.0f) json_fault(condition_at, "it is negative");
  if (part.reach < 0.0f) json_fault(reach_at, "it is negative");
  const Json& boxes = json_array(boxes_at, json_required(location, object, "boxes"));
  if (boxes.size() > kMostPartBoxes)
    json_fault(boxes_at, std::to_string(boxes.size()) + " boxes; the limit is " + std::to_string(kMostPartBoxes));
  for (std::size_t i = 0; i < boxes.size(); ++i) part.boxes.push_back(box_at(JsonLocation(boxes_at, i), boxes[i]));
  return part;
}

PartManifest manifest_of(std::string_view text, const std::string& path) {
  const Json document = parse_json(text, kMostLevels);
  const JsonLocation root;
  json_object(root, document);
  const JsonLocation format_at(root, "format"), version_at(root, "version"), levels_at(root, "levels"),
      materials_at(root, "materials"), parts_at(root, "parts"), shared_at(root, "shared");
  if (const std::string& format = json_string(format_at, json_required(root, document, "format"));
      format != kFormatName)
    json_fault(format_at, in_quotes(format) + "; expected 'hiprt parts'");
  if (const std::uint32_t version = json_uint32(version_at, json_required(root, document, "version"));
      version != kManifestVersion)
    json_fault(version_at, std::to_string(version) + "; this program reads version 1");
  PartManifest manifest;
  manifest.path = path;
  manifest.levels = json_uint32(levels_at, json_required(root, document, "levels"));
  if (manifest.levels == 0) json_fault(levels_at, "there are no levels of instances");
  manifest.instances = count_at(root, document, "instances");
  const Json& materials = json_required(root, document, "materials");
  if (!materials.is_boolean()) json_fault(materials_at, "it is neither true nor false");
  manifest.materials = materials.get<bool>();
  const Json& parts = json_array(parts_at, json_required(root, document, "parts"));
  if (parts.empty() || parts.size() > kMostParts)
    json_fault(parts_at,
               std::to_string(parts.size()) + " parts; there are 1 to " + std::to_string(kMostParts) + " of them");
  for (std::size_t i = 0; i < parts.size(); ++i) manifest.parts.push_back(part_at(JsonLocation(parts_at, i), parts[i]));
  if (const auto shared = document.find("shared"); shared != document.end())
    manifest.shared = part_at(shared_at, *shared);
  return manifest;
}

Json json_of(const PartFile& file) { return {{"name", file.name}, {"bytes", file.bytes}, {"xxh3", file.checksum}}; }

Json json_of(const Box& box) { return {box.min[0], box.min[1], box.min[2], box.max[0], box.max[1], box.max[2]}; }

Json json_of(const ScenePart& part) {
  Json boxes = Json::array();
  for (const Box& box : part.boxes) boxes.push_back(json_of(box));
  return {{"bvh", json_of(part.bvh)},
          {"data", json_of(part.data)},
          {"instances", part.instances},
          {"bounds", json_of(part.bounds)},
          {"condition", part.condition},
          {"reach", part.reach},
          {"boxes", boxes}};
}

}  // namespace

Box PartManifest::bounds() const {
  Box result{};
  bool first = true;
  const auto add = [&](const ScenePart& part) {
    if (part.boxes.empty()) return;
    for (unsigned axis = 0; axis < 3; ++axis) {
      result.min[axis] = first ? part.bounds.min[axis] : std::min(result.min[axis], part.bounds.min[axis]);
      result.max[axis] = first ? part.bounds.max[axis] : std::max(result.max[axis], part.bounds.max[axis]);
    }
    first = false;
  };
  for (const ScenePart& part : parts) add(part);
  if (shared) add(*shared);
  return result;
}

std::string PartManifest::path_of(const PartFile& file) const {
  return (std::filesystem::path(path).parent_path() / file.name).string();
}

bool is_part_manifest(std::string_view path) { return has_extension(path, ".json"); }

build::Result<PartManifest> parse_part_manifest(std::string_view text, const std::string& path) {
  try {
    skip_byte_order_mark(text);
    return manifest_of(text, path);
  } catch (const JsonFault& fault) {
    return invalid_input(path + ": " + fault.message);
  }
}

std::string to_json(const PartManifest& manifest) {
  Json parts = Json::array();
  for (const ScenePart& part : manifest.parts) parts.push_back(json_of(part));
  Json document = {{"format", kFormatName},           {"version", kManifestVersion},     {"levels", manifest.levels},
                   {"instances", manifest.instances}, {"materials", manifest.materials}, {"parts", parts}};
  if (manifest.shared) document["shared"] = json_of(*manifest.shared);
  return document.dump(1) + "\n";
}

}  // namespace hiprt::tools
