#include <tools/scene_io/gltf/gltf_extensions.h>

#include <tools/base/errors.h>
#include <tools/base/text.h>
#include <tools/scene_io/gltf/gltf_compression.h>
#include <tools/scene_io/gltf/gltf_instancing.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <string>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

/// Extensions that say how to read triangles, or materials if those are read.
constexpr std::array<std::string_view, 6> kRead{
    "KHR_mesh_quantization",           kGpuInstancing, "KHR_texture_transform",
    "KHR_materials_emissive_strength", kDraco,         kMeshopt};
/// Extensions of images, which a file may require without any effect on its triangles.
constexpr std::array<std::string_view, 5> kImages{"KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif",
                                                  "EXT_texture_procedurals", "MSFT_texture_dds"};

template <std::size_t N> bool is_one_of(const std::array<std::string_view, N>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_of_surfaces(std::string_view extension) {
  return extension.starts_with("KHR_materials_") || is_one_of(kImages, extension);
}

/// Why a file that requires an extension is refused; empty: it is not.
std::string fault_of(std::string_view extension) {
  if (extension == kDraco || extension == kMeshopt) {
    const bool draco = extension == kDraco;
    if (draco ? has_draco() : has_meshopt()) return {};
    return std::string("compressed meshes, and this build has no decoder: install ") +
           (draco ? "libdraco-dev" : "libmeshoptimizer-dev") + " and build it again, or export without compression";
  }
  if (is_one_of(kRead, extension) || is_of_surfaces(extension) || extension == "KHR_lights_punctual") return {};
  return "which is not supported: export the file without it";
}

/// Counts the objects that have each extension. Recursion: check_gltf() limits the depth.
void count(const Json& value, std::map<std::string, std::uint64_t>& counts) {
  if (value.is_object())
    if (const auto extensions = value.find("extensions"); extensions != value.end() && extensions->is_object())
      for (const auto& [name, content] : extensions->items()) ++counts[name];
  if (value.is_structured())
    for (const Json& part : value) count(part, counts);
}

}  // namespace

build::Result<void> check_required_extensions(const Json& document) {
  const auto list = document.is_object() ? document.find("extensionsRequired") : document.end();
  if (list == document.end() || !list->is_array()) return {};
  for (const Json& name : *list) {
    if (!name.is_string()) continue;  // Checker refuses it.
    const auto& extension = name.get_ref<const std::string&>();
    if (const std::string fault = fault_of(extension); !fault.empty())
      return invalid_input("it requires the extension " + in_quotes(extension) + ", " + fault);
  }
  return {};
}

void add_ignored_extensions(const Json& document, bool surfaces, Ignored& ignored) {
  std::map<std::string, std::uint64_t> counts;
  count(document, counts);
  for (const auto& [name, number] : counts)
    if (!is_one_of(kRead, name) && (surfaces || !is_of_surfaces(name)))
      ignored.add("extension " + in_quotes(name), number);
}

}  // namespace hiprt::tools
