#include <tools/scene_io/gltf/gltf_material.h>

#include <tools/base/errors.h>
#include <tools/base/text.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kDefault = -1;
const JsonLocation kRoot;

/// "material 3 'leaf'".
std::string label_of(const Json& material, std::int64_t index) {
  std::string label = "material " + std::to_string(index);
  const Json* name = material.is_object() ? json_member(material, "name") : nullptr;
  if (name != nullptr && name->is_string() && !name->get_ref<const std::string&>().empty())
    label += " " + in_quotes(name->get_ref<const std::string&>());
  return label;
}

/// Files round: a thousandth outside [0, 1] is taken for its end.
float unit_number(const JsonLocation& location, double value) {
  constexpr double kTolerance = 1e-3;
  if (!(value >= -kTolerance && value <= 1 + kTolerance))
    json_fault(location, Json(value).dump() + ", 0 to 1 expected");
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

void read_unit(const JsonLocation& outer, const Json& object, const char* key, float& to) {
  const JsonLocation location(outer, key);
  if (const Json* value = json_member(object, key)) to = unit_number(location, json_number(location, *value));
}

void read_base(const JsonLocation& location, const Json& pbr, Material& to) {
  if (const Json* value = json_member(pbr, "baseColorFactor")) {
    const JsonLocation factor_location(location, "baseColorFactor");
    const auto factor = json_numbers<4>(factor_location, *value);
    for (std::size_t i = 0; i < 3; ++i) to.base_color[i] = unit_number(JsonLocation(factor_location, i), factor[i]);
    to.alpha = unit_number(JsonLocation(factor_location, 3), factor[3]);
  }
  read_unit(location, pbr, "metallicFactor", to.metallic);
  read_unit(location, pbr, "roughnessFactor", to.roughness);
}

/// KHR_materials_emissive_strength: 1 without.
double emissive_strength(const Json& source) {
  const Json* extensions = json_member(source, "extensions");
  if (extensions == nullptr) return 1;
  const JsonLocation all(kRoot, "extensions"), location(all, "KHR_materials_emissive_strength"),
      at(location, "emissiveStrength");
  const Json* extension = json_member(json_object(all, *extensions), "KHR_materials_emissive_strength");
  const Json* value =
      extension == nullptr ? nullptr : json_member(json_object(location, *extension), "emissiveStrength");
  if (value == nullptr) return 1;
  const double strength = json_number(at, *value);
  if (!(strength >= 0)) json_fault(at, value->dump() + ", 0 or more expected");
  return strength;
}

void read_emission(const Json& source, Material& to) {
  const JsonLocation location(kRoot, "emissiveFactor");
  const double strength = emissive_strength(source);
  const Json* value = json_member(source, "emissiveFactor");
  if (value == nullptr) return;
  const auto factor = json_numbers<3>(location, *value);
  for (std::size_t i = 0; i < 3; ++i) {
    to.emission[i] = static_cast<float>(factor[i] * strength);
    if (!(factor[i] >= 0)) json_fault(JsonLocation(location, i), Json(factor[i]).dump() + ", 0 or more expected");
    if (!std::isfinite(to.emission[i]))
      json_fault(JsonLocation(location, i), "with the strength it is larger than single precision can hold");
  }
}

float cutoff_of(const Json& source) {
  constexpr float kHalf = 0.5f;
  const JsonLocation mode_location(kRoot, "alphaMode"), location(kRoot, "alphaCutoff");
  const Json* value = json_member(source, "alphaMode");
  const std::string mode = value == nullptr ? "OPAQUE" : json_string(mode_location, *value);
  if (mode == "OPAQUE") return 0;
  if (mode == "BLEND") return kHalf;
  if (mode != "MASK") json_fault(mode_location, in_quotes(mode) + ", 'OPAQUE', 'MASK' or 'BLEND' expected");
  const Json* cutoff = json_member(source, "alphaCutoff");
  if (cutoff == nullptr) return kHalf;
  const auto number = static_cast<float>(json_number(location, *cutoff));
  if (!(number >= 0 && std::isfinite(number))) json_fault(location, cutoff->dump() + ", 0 or more expected");
  return number;
}

}  // namespace

GltfMaterials::GltfMaterials(Json document, const tinygltf::Model& model, std::filesystem::path folder,
                             MaterialLibrary& library, Ignored& ignored)
    : document_(std::move(document)),
      library_(library),
      ignored_(ignored),
      textures_(document_, model, std::move(folder), library, ignored) {}

build::Result<std::uint32_t> GltfMaterials::of_primitive(std::size_t mesh, std::size_t primitive) {
  try {
    const JsonLocation meshes(kRoot, "meshes"), mesh_location(meshes, mesh), primitives(mesh_location, "primitives"),
        primitive_location(primitives, primitive), location(primitive_location, "material");
    const Json* value = json_member(document_.at("meshes").at(mesh).at("primitives").at(primitive), "material");
    if (value == nullptr) return number_of(kDefault);
    const std::uint32_t index = json_uint32(location, *value);
    json_item(location, document_, "materials", index);
    return number_of(index);
  } catch (const JsonFault& fault) {
    return invalid_input(fault.message);
  }
}

build::Result<std::uint32_t> GltfMaterials::number_of(std::int64_t index) {
  if (const auto known = numbers_.find(index); known != numbers_.end()) return known->second;
  Material material;
  if (index != kDefault) {
    const Json& source = document_["materials"][static_cast<std::size_t>(index)];
    const std::string label = label_of(source, index);
    auto read_one = read(source);
    if (!read_one) return tl::unexpected(build::Error{read_one.error().code, label + ": " + read_one.error().message});
    material = std::move(*read_one);
    material.name = label;
  } else {
    material.name = "default material";
  }
  const auto number = static_cast<std::uint32_t>(library_.materials.size());
  library_.materials.push_back(std::move(material));
  numbers_.emplace(index, number);
  return number;
}

build::Result<Material> GltfMaterials::read(const Json& source) {
  try {
    if (!source.is_object()) return invalid_input("it is not an object");
    Material material;
    const JsonLocation location(kRoot, "pbrMetallicRoughness");
    if (const Json* pbr = json_member(source, "pbrMetallicRoughness"))
      read_base(location, json_object(location, *pbr), material);
    read_emission(source, material);
    material.alpha_cutoff = cutoff_of(source);
    if (auto done = read_textures(source, material); !done) return tl::unexpected(done.error());
    count_ignored(source);
    return material;
  } catch (const JsonFault& fault) {
    return invalid_input(fault.message);
  }
}

void GltfMaterials::count_ignored(const Json& source) {
  if (source.contains("normalTexture")) ignored_.add("normal textures");
  if (source.contains("occlusionTexture")) ignored_.add("occlusion textures");
  if (source.value("alphaMode", "OPAQUE") == "BLEND") ignored_.add("half transparency of materials (cut at 0.5)");
}

build::Result<void> GltfMaterials::read_textures(const Json& source, Material& material) {
  const JsonLocation pbr_location(kRoot, "pbrMetallicRoughness");
  const Json* pbr = json_member(source, "pbrMetallicRoughness");
  struct Slot {
    const JsonLocation& outer;
    const Json* object;
    const char *key, *name;
    TextureUse& use;
  };
  const std::array<Slot, 3> slots{
      {{pbr_location, pbr, "baseColorTexture", "base colour", material.base_color_texture},
       {pbr_location, pbr, "metallicRoughnessTexture", "metal and roughness", material.metallic_roughness_texture},
       {kRoot, &source, "emissiveTexture", "emission", material.emission_texture}}};
  for (const Slot& slot : slots) {
    const Json* info = slot.object == nullptr ? nullptr : json_member(*slot.object, slot.key);
    if (info == nullptr) continue;
    auto use = textures_.use(JsonLocation(slot.outer, slot.key), *info);
    if (!use)
      return tl::unexpected(build::Error{use.error().code, std::string(slot.name) + ": " + use.error().message});
    slot.use = *use;
  }
  return {};
}

}  // namespace hiprt::tools
