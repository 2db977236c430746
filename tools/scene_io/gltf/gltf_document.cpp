#include <tools/scene_io/gltf/gltf_document.h>

#include <tools/base/errors.h>
#include <tools/scene_io/gltf/gltf_buffers.h>
#include <tools/scene_io/gltf/gltf_check.h>
#include <tools/scene_io/gltf/gltf_compression.h>
#include <tools/scene_io/gltf/gltf_extensions.h>
#include <tools/scene_io/gltf/gltf_instancing.h>
#include <tools/scene_io/gltf/gltf_part.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

/// What tinygltf is to parse. It would load buffers itself, refuse indices without a bufferView, which may be
/// compressed, and follow images into buffers without a check.
Json for_tinygltf(Json document) {
  for (const char* key : {"images", "textures", "samplers", "materials", "extras"}) document.erase(key);
  if (const auto buffers = document.find("buffers"); buffers != document.end())
    for (Json& buffer : *buffers) buffer = {{"byteLength", 3}, {"uri", "data:application/octet-stream;base64,AAAA"}};
  if (const auto meshes = document.find("meshes"); meshes != document.end())
    for (Json& mesh : *meshes)
      for (Json& primitive : mesh["primitives"]) primitive.erase("indices");
  return document;
}

/// Puts the numbers of the primitives' indices into the model.
void restore_indices(const Json& document, tinygltf::Model& model) {
  for (std::size_t m = 0; m < model.meshes.size(); ++m)
    for (std::size_t p = 0; p < model.meshes[m].primitives.size(); ++p) {
      const Json& primitive = document["meshes"][m]["primitives"][p];
      if (const auto indices = primitive.find("indices"); indices != primitive.end())
        model.meshes[m].primitives[p].indices = indices->get<int>();
    }
}

/// Data URIs may be most of a file.
void remove_uris(Json& document) {
  if (const auto buffers = document.find("buffers"); buffers != document.end())
    for (Json& buffer : *buffers) buffer.erase("uri");
}

build::Result<void> parse(const Json& document, tinygltf::Model& model) {
  const std::string text = for_tinygltf(document).dump();
  if (text.size() > std::numeric_limits<unsigned>::max())
    return fail(build::ErrorCode::kTooLarge, "the JSON of glTF files ends at 4294967295 bytes");
  tinygltf::TinyGLTF loader;
  std::string error, warning;
  if (!loader.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), ""))
    return invalid_input("its JSON is not that of glTF 2.0: " + (error.empty() ? "no reason given" : error));
  restore_indices(document, model);
  return {};
}

/// Counts what makes no triangles, what is not in the scene, and what surfaces lack.
void count_ignored(GltfDocument& document, bool surfaces) {
  for (const tinygltf::Mesh& mesh : document.model.meshes)
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      if (surfaces && primitive.attributes.contains("COLOR_0")) document.ignored.add("primitives' vertex colours");
      const bool points = primitive.mode == TINYGLTF_MODE_POINTS;
      if (!has_triangles(primitive)) document.ignored.add(points ? "primitives of points" : "primitives of lines");
    }
  for (const tinygltf::Node& node : document.model.nodes) document.ignored.add("cameras", node.camera >= 0 ? 1 : 0);
  if (document.model.scenes.size() > 1) document.ignored.add("other scenes", document.model.scenes.size() - 1);
}

/// Without instances a node has its mesh once.
void count_instancing(GltfDocument& document) {
  for (const tinygltf::Node& node : document.model.nodes)
    if (node.extensions.contains(std::string(kGpuInstancing)))
      document.ignored.add("extension '" + std::string(kGpuInstancing) + "' without --instances");
}

}  // namespace

build::Result<void> load_document(std::span<const std::byte> file, const std::filesystem::path& folder, bool instancing,
                                  MaterialLibrary* library, GltfDocument& document) {
  auto json = check_gltf(file);
  if (!json) return tl::unexpected(std::move(json.error()));
  document.json = std::move(*json);
  const Json required = document.json.value("extensionsRequired", Json::array());
  if (!instancing && std::find(required.begin(), required.end(), kGpuInstancing) != required.end())
    return invalid_input("it requires the extension " + std::string(kGpuInstancing) +
                         ", which is not supported without instances: build with --instances");
  auto buffers = load_buffers(document.json, file, folder, document.files);
  if (!buffers) return tl::unexpected(std::move(buffers.error()));
  remove_uris(document.json);
  if (auto parsed = parse(document.json, document.model); !parsed) return parsed;
  for (std::size_t i = 0; i < buffers->size(); ++i) document.model.buffers[i].data = std::move((*buffers)[i]);
  if (auto done = decode_meshopt(document.json, document.model); !done) return done;
  if (auto done = decode_draco(document.json, document.model); !done) return done;
  count_ignored(document, library != nullptr);
  add_ignored_extensions(document.json, library != nullptr, document.ignored);
  if (!instancing) count_instancing(document);
  if (library != nullptr) document.materials.emplace(document.json, document.model, folder, *library, document.ignored);
  return {};
}

}  // namespace hiprt::tools
