/// glTF 2.0 and GLB through tinygltf, which parses the JSON and loads buffers; accessors and nodes are ours.

#include <tools/base/interrupt.h>
#include <tools/scene_io/gltf/gltf_animation.h>
#include <tools/scene_io/gltf/gltf_check.h>
#include <tools/scene_io/gltf/gltf_instancing.h>
#include <tools/scene_io/gltf/gltf_material.h>
#include <tools/scene_io/gltf/gltf_part.h>
#include <tools/scene_io/gltf/gltf_scene.h>
#include <tools/scene_io/mesh/mesh_formats.h>

#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>

namespace hiprt::tools {
namespace {

/// Exists, whatever it is. Opening it, as tinygltf does to find out, would wait for a FIFO's writer.
bool exists(const std::string& path, void*) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

/// Notes in *data, a vector of strings, which files were read.
/// Textures may be much larger than meshes and are not wanted: their files count as read.
bool read_file_but_images(std::vector<unsigned char>* out, std::string* error, const std::string& path, void* data) {
  constexpr std::array<std::string_view, 6> kImages{".png", ".jpg", ".jpeg", ".webp", ".ktx2", ".dds"};
  if (std::any_of(kImages.begin(), kImages.end(), [&](std::string_view ending) { return path.ends_with(ending); })) {
    out->assign(1, 0);
    return true;
  }
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) {
    static_cast<std::vector<std::string>*>(data)->push_back(path);
    return tinygltf::ReadWholeFile(out, error, path, nullptr);
  }
  *error += "it is not a regular file";
  return false;
}

/// @tparam Callbacks tinygltf::FsCallbacks. That of version 2.9 also asks for the sizes of files; 0 is below its limit.
template <class Callbacks> Callbacks file_callbacks(std::vector<std::string>& files) {
  Callbacks callbacks{};
  callbacks.FileExists = &exists;
  callbacks.ExpandFilePath = &tinygltf::ExpandFilePath;
  callbacks.ReadWholeFile = &read_file_but_images;
  callbacks.WriteWholeFile = &tinygltf::WriteWholeFile;
  if constexpr (requires { callbacks.GetFileSizeInBytes; })
    callbacks.GetFileSizeInBytes = [](std::size_t* size, std::string*, const std::string&, void*) {
      *size = 0;
      return true;
    };
  callbacks.user_data = &files;
  return callbacks;
}

bool ignore_image(tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int, void*) {
  return true;
}

build::Result<void> parse(std::span<const std::byte> bytes, const std::filesystem::path& folder, tinygltf::Model& model,
                          std::vector<std::string>& files) {
  if (bytes.size() > std::numeric_limits<unsigned>::max())
    return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "glTF files end at 4294967295 bytes"});
  if (auto checked = check_gltf(bytes); !checked) return checked;
  const auto size = static_cast<unsigned>(bytes.size());
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(ignore_image, nullptr);
  loader.SetFsCallbacks(file_callbacks<tinygltf::FsCallbacks>(files));
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  std::string error, warning;
  const bool loaded =
      text.starts_with("glTF")
          ? loader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
                                        size, folder.string())
          : loader.LoadASCIIFromString(&model, &error, &warning, text.data(), size, folder.string());
  if (!loaded) return invalid_input("not a whole glTF 2.0 file: " + (error.empty() ? "no reason given" : error));
  return {};
}

/// Extensions that do not change which triangles there are.
bool harmless(std::string_view extension) {
  return extension == "KHR_mesh_quantization" || extension == "KHR_texture_transform" ||
         extension == "KHR_texture_basisu" || extension == "EXT_texture_webp" || extension == "KHR_lights_punctual" ||
         extension.starts_with("KHR_materials_");
}

/// A file, and what its surfaces look like if that is asked for.
struct Document {
  tinygltf::Model model;
  std::optional<GltfMaterials> materials;
};

/// The supported parts of the document.
/// @param library nullptr: materials are not asked for.
build::Result<void> load(std::span<const std::byte> bytes, const std::filesystem::path& folder, bool instancing,
                         MaterialLibrary* library, Document& document, std::vector<std::string>& files) {
  if (auto parsed = parse(bytes, folder, document.model, files); !parsed) return parsed;
  for (const std::string& extension : document.model.extensionsRequired)
    if (!harmless(extension) && !(instancing && extension == kGpuInstancing))
      return invalid_input("it requires the extension " + extension + ", which is not supported" +
                           (extension == kGpuInstancing ? " without instances" : ""));
  if (library == nullptr) return {};
  const auto json = gltf_json(bytes);
  if (!json) return tl::unexpected(json.error());
  document.materials.emplace(nlohmann::json::parse(*json), document.model, folder, *library);
  return {};
}

/// Appends the triangles of a mesh.
build::Result<void> append(Mesh& mesh, Document& document, int index, const Transform& to_world) {
  const auto number = static_cast<std::size_t>(index);
  const auto& primitives = document.model.meshes[number].primitives;
  const bool surfaces = document.materials.has_value();
  if (surfaces && !mesh.surface) mesh.surface.emplace();
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    if (interrupted()) return cancelled();
    if (!has_triangles(primitives[i])) continue;
    const auto part = read_part(document.model, primitives[i], surfaces);
    if (!part)
      return invalid_input("mesh " + std::to_string(index) + ", primitive " + std::to_string(i) + ": " +
                           part.error().message);
    build::Result<std::uint32_t> material = 0;
    if (surfaces && !part->triangles.empty()) material = document.materials->of_primitive(number, i);
    if (!material) return tl::unexpected(material.error());
    if (auto done = append(mesh, *part, to_world, *material); !done) return done;
  }
  return {};
}

void add_image_files(const Document& document, std::vector<std::string>& files) {
  if (!document.materials) return;
  const std::vector<std::string>& images = document.materials->files();
  files.insert(files.end(), images.begin(), images.end());
}

/// The nodes at each time; once where they are without animations if there is no time.
build::Result<std::vector<std::vector<NodeMesh>>> poses_of(tinygltf::Model& model, const std::vector<float>& times) {
  std::vector<std::vector<NodeMesh>> poses;
  const auto add = [&]() -> build::Result<void> {
    auto nodes = flatten(model);
    if (!nodes) return tl::unexpected(nodes.error());
    poses.push_back(std::move(*nodes));
    return {};
  };
  if (times.empty()) {
    if (auto added = add(); !added) return tl::unexpected(added.error());
    return poses;
  }
  const auto animation = Animation::read(model);
  if (!animation) return tl::unexpected(animation.error());
  for (const float time : times) {
    if (interrupted()) return cancelled();
    animation->pose(static_cast<double>(time), model);
    if (auto added = add(); !added) return tl::unexpected(added.error());
  }
  return poses;
}

}  // namespace

build::Result<Mesh> read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                              MaterialLibrary* library) {
  Document document;
  Mesh mesh;
  if (auto loaded = load(bytes, folder, false, library, document, mesh.files); !loaded)
    return tl::unexpected(loaded.error());
  const auto uses = flatten(document.model);
  if (!uses) return tl::unexpected(uses.error());
  if (library != nullptr) mesh.surface.emplace();  // Also of a file without nodes.
  for (const NodeMesh& use : *uses)
    if (auto done = append(mesh, document, use.mesh, use.to_world); !done) return tl::unexpected(done.error());
  add_image_files(document, mesh.files);
  return mesh;
}

build::Result<MeshAssembly> read_gltf_assembly(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                                               const std::string& name, const std::vector<float>& times,
                                               MaterialLibrary* library) {
  Document document;
  tinygltf::Model& model = document.model;
  MeshAssembly result;
  if (auto loaded = load(bytes, folder, true, library, document, result.files); !loaded)
    return tl::unexpected(loaded.error());
  const auto poses = poses_of(model, times);
  if (!poses) return tl::unexpected(poses.error());
  const std::vector<NodeMesh>& nodes = poses->front();
  constexpr std::size_t kNotRead = std::numeric_limits<std::size_t>::max(), kEmpty = kNotRead - 1;
  std::vector<std::size_t> numbers(model.meshes.size(), kNotRead);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const NodeMesh& node = nodes[i];
    std::size_t& number = numbers[static_cast<std::size_t>(node.mesh)];
    if (number == kNotRead) {
      Mesh mesh;
      mesh.name = name + " mesh " + std::to_string(node.mesh);
      if (auto done = append(mesh, document, node.mesh, Transform{}); !done) return tl::unexpected(done.error());
      number = mesh.triangles.empty() ? kEmpty : result.meshes.size();
      if (number != kEmpty) result.meshes.push_back(std::move(mesh));
    }
    if (number == kEmpty) continue;
    const auto placements = gpu_instances(model, node.node);
    if (!placements) return tl::unexpected(placements.error());
    std::vector<Transform> keys;
    for (const std::vector<NodeMesh>& pose : *poses) keys.push_back(pose[i].to_world);
    const bool moves = std::any_of(keys.begin(), keys.end(), [&](const Transform& t) { return t.m != keys[0].m; });
    for (const Transform& placement : *placements) {
      MeshUse& use = result.uses.emplace_back(MeshUse{number, node.to_world * placement});
      for (std::size_t k = 0; moves && k < keys.size(); ++k) use.keys.push_back(keys[k] * placement);
    }
  }
  add_image_files(document, result.files);
  return result;
}

}  // namespace hiprt::tools
