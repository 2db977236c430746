#include <tools/scene_io/gltf/gltf_material.h>

#include <tools/scene_io/mesh/mesh_formats.h>
#include <tools/scene_io/text.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kDefault = -1;
const JsonPlace kRoot;

/// "material 3 'leaf'".
std::string label_of(const Json& material, std::int64_t index) {
  std::string label = "material " + std::to_string(index);
  const Json* name = material.is_object() ? json_member(material, "name") : nullptr;
  if (name != nullptr && name->is_string() && !name->get_ref<const std::string&>().empty())
    label += " " + in_quotes(name->get_ref<const std::string&>());
  return label;
}

/// Files round: a thousandth outside [0, 1] is taken for its end.
float unit_number(const JsonPlace& place, double value) {
  constexpr double kTolerance = 1e-3;
  if (!(value >= -kTolerance && value <= 1 + kTolerance)) json_fault(place, Json(value).dump() + ", 0 to 1 expected");
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

void read_unit(const JsonPlace& outer, const Json& object, const char* key, float& to) {
  const JsonPlace place(outer, key);
  if (const Json* value = json_member(object, key)) to = unit_number(place, json_number(place, *value));
}

void read_base(const JsonPlace& place, const Json& pbr, Material& to) {
  if (const Json* value = json_member(pbr, "baseColorFactor")) {
    const JsonPlace factor_place(place, "baseColorFactor");
    const auto factor = json_numbers<4>(factor_place, *value);
    for (std::size_t i = 0; i < 3; ++i) to.base_color[i] = unit_number(JsonPlace(factor_place, i), factor[i]);
    to.alpha = unit_number(JsonPlace(factor_place, 3), factor[3]);
  }
  read_unit(place, pbr, "metallicFactor", to.metallic);
  read_unit(place, pbr, "roughnessFactor", to.roughness);
}

/// KHR_materials_emissive_strength: 1 without.
double emissive_strength(const Json& source) {
  const Json* extensions = json_member(source, "extensions");
  if (extensions == nullptr) return 1;
  const JsonPlace all(kRoot, "extensions"), place(all, "KHR_materials_emissive_strength"),
      at(place, "emissiveStrength");
  const Json* extension = json_member(json_object(all, *extensions), "KHR_materials_emissive_strength");
  const Json* value = extension == nullptr ? nullptr : json_member(json_object(place, *extension), "emissiveStrength");
  if (value == nullptr) return 1;
  const double strength = json_number(at, *value);
  if (!(strength >= 0)) json_fault(at, value->dump() + ", 0 or more expected");
  return strength;
}

void read_emission(const Json& source, Material& to) {
  const JsonPlace place(kRoot, "emissiveFactor");
  const double strength = emissive_strength(source);
  const Json* value = json_member(source, "emissiveFactor");
  if (value == nullptr) return;
  const auto factor = json_numbers<3>(place, *value);
  for (std::size_t i = 0; i < 3; ++i) {
    to.emission[i] = static_cast<float>(factor[i] * strength);
    if (!(factor[i] >= 0)) json_fault(JsonPlace(place, i), Json(factor[i]).dump() + ", 0 or more expected");
    if (!std::isfinite(to.emission[i]))
      json_fault(JsonPlace(place, i), "with the strength it is larger than single precision can hold");
  }
}

float cutoff_of(const Json& source) {
  constexpr float kHalf = 0.5f;
  const JsonPlace mode_place(kRoot, "alphaMode"), place(kRoot, "alphaCutoff");
  const Json* value = json_member(source, "alphaMode");
  const std::string mode = value == nullptr ? "OPAQUE" : json_string(mode_place, *value);
  if (mode == "OPAQUE") return 0;
  if (mode == "BLEND") return kHalf;
  if (mode != "MASK") json_fault(mode_place, in_quotes(mode) + ", 'OPAQUE', 'MASK' or 'BLEND' expected");
  const Json* cutoff = json_member(source, "alphaCutoff");
  if (cutoff == nullptr) return kHalf;
  const auto number = static_cast<float>(json_number(place, *cutoff));
  if (!(number >= 0 && std::isfinite(number))) json_fault(place, cutoff->dump() + ", 0 or more expected");
  return number;
}

}  // namespace

GltfMaterials::GltfMaterials(Json document, const tinygltf::Model& model, std::filesystem::path folder,
                             MaterialLibrary& library)
    : document_(std::move(document)), library_(library), textures_(document_, model, std::move(folder), library) {}

build::Result<std::uint32_t> GltfMaterials::of_primitive(std::size_t mesh, std::size_t primitive) {
  try {
    const JsonPlace meshes(kRoot, "meshes"), mesh_place(meshes, mesh), primitives(mesh_place, "primitives"),
        primitive_place(primitives, primitive), place(primitive_place, "material");
    const Json* value = json_member(document_.at("meshes").at(mesh).at("primitives").at(primitive), "material");
    if (value == nullptr) return number_of(kDefault);
    const std::uint32_t index = json_uint32(place, *value);
    json_item(place, document_, "materials", index);
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
    const JsonPlace place(kRoot, "pbrMetallicRoughness");
    if (const Json* pbr = json_member(source, "pbrMetallicRoughness"))
      read_base(place, json_object(place, *pbr), material);
    read_emission(source, material);
    material.alpha_cutoff = cutoff_of(source);
    if (auto done = read_textures(source, material); !done) return tl::unexpected(done.error());
    return material;
  } catch (const JsonFault& fault) {
    return invalid_input(fault.message);
  }
}

build::Result<void> GltfMaterials::read_textures(const Json& source, Material& material) {
  const JsonPlace pbr_place(kRoot, "pbrMetallicRoughness");
  const Json* pbr = json_member(source, "pbrMetallicRoughness");
  struct Slot {
    const JsonPlace& outer;
    const Json* object;
    const char *key, *name;
    TextureUse& use;
  };
  const std::array<Slot, 3> slots{
      {{pbr_place, pbr, "baseColorTexture", "base colour", material.base_color_texture},
       {pbr_place, pbr, "metallicRoughnessTexture", "metal and roughness", material.metallic_roughness_texture},
       {kRoot, &source, "emissiveTexture", "emission", material.emission_texture}}};
  for (const Slot& slot : slots) {
    const Json* info = slot.object == nullptr ? nullptr : json_member(*slot.object, slot.key);
    if (info == nullptr) continue;
    auto use = textures_.use(JsonPlace(slot.outer, slot.key), *info);
    if (!use)
      return tl::unexpected(build::Error{use.error().code, std::string(slot.name) + ": " + use.error().message});
    slot.use = *use;
  }
  return {};
}

}  // namespace hiprt::tools
