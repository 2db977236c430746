/// glTF 2.0 and GLB through tinygltf, which parses the JSON and loads buffers; accessors and nodes are ours.

#include "gltf_accessor.h"
#include "gltf_animation.h"
#include "gltf_check.h"
#include "gltf_instancing.h"
#include "gltf_scene.h"
#include "mesh_formats.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
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
  loader.SetFsCallbacks({&exists, &tinygltf::ExpandFilePath, &read_file_but_images, &tinygltf::WriteWholeFile, &files});
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

/// Calls emit(a, b, c) for every triangle of a list, strip or fan of n corners (glTF 2.0, 3.7.2.1).
template <class Emit> void for_each_triangle(int mode, std::size_t n, Emit&& emit) {
  if (mode == TINYGLTF_MODE_TRIANGLES)
    for (std::size_t i = 0; i + 3 <= n; i += 3) emit(i, i + 1, i + 2);
  if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
    for (std::size_t i = 0; i + 3 <= n; ++i) emit(i, i + 1 + i % 2, i + 2 - i % 2);
  if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
    for (std::size_t i = 1; i + 2 <= n; ++i) emit(i, i + 1, 0);
}

/// The triangles of one primitive in its own space.
struct Part {
  std::vector<build::Position> positions;
  std::vector<build::Triangle> triangles;
};

/// Can n corners be what the mode says (glTF 2.0, 3.7.2.1)?
build::Result<void> check_corners(int mode, std::size_t n) {
  if (mode == TINYGLTF_MODE_TRIANGLES && n % 3 != 0)
    return invalid_input(std::to_string(n) + " corners, but a list of triangles needs a multiple of 3");
  if (mode != TINYGLTF_MODE_TRIANGLES && n < 3)
    return invalid_input(std::to_string(n) + " corners, but a strip or fan needs at least 3");
  return {};
}

build::Result<Part> read_part(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const auto position = primitive.attributes.find("POSITION");
  if (position == primitive.attributes.end()) return Part{};
  auto positions = read_positions(model, position->second);
  if (!positions) return tl::unexpected(positions.error());
  std::vector<std::uint32_t> corners;
  if (primitive.indices >= 0) {
    auto indices = read_indices(model, primitive.indices);
    if (!indices) return tl::unexpected(indices.error());
    corners = std::move(*indices);
    const auto wrong = std::find_if(corners.begin(), corners.end(), [&](auto c) { return c >= positions->size(); });
    if (wrong != corners.end())
      return invalid_input("accessor " + std::to_string(primitive.indices) + ": vertex " + std::to_string(*wrong) +
                           ", but the primitive has only " + std::to_string(positions->size()));
  } else {
    corners.resize(positions->size());
    std::iota(corners.begin(), corners.end(), 0u);
  }
  if (auto checked = check_corners(primitive.mode, corners.size()); !checked) return tl::unexpected(checked.error());
  Part part{std::move(*positions), {}};
  for_each_triangle(primitive.mode, corners.size(), [&](std::size_t a, std::size_t b, std::size_t c) {
    part.triangles.push_back({corners[a], corners[b], corners[c]});
  });
  return part;
}

build::Result<void> append(Mesh& mesh, const Part& part, const Transform& to_world) {
  if (part.positions.size() > std::numeric_limits<std::uint32_t>::max() - mesh.positions.size())
    return tl::unexpected(
        build::Error{build::ErrorCode::kTooLarge, "all nodes together have more than 4294967295 vertices"});
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  for (const build::Position& position : part.positions) mesh.positions.push_back(to_world(position));
  const bool mirrored = to_world.mirrors();
  for (const build::Triangle& t : part.triangles)
    mesh.triangles.push_back({base + t[0], base + t[mirrored ? 2 : 1], base + t[mirrored ? 1 : 2]});
  return {};
}

bool has_triangles(const tinygltf::Primitive& primitive) {
  return primitive.mode == TINYGLTF_MODE_TRIANGLES || primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
         primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
}

/// The whole document, of what is supported.
build::Result<void> load(std::span<const std::byte> bytes, const std::filesystem::path& folder, bool instancing,
                         tinygltf::Model& model, std::vector<std::string>& files) {
  if (auto parsed = parse(bytes, folder, model, files); !parsed) return parsed;
  for (const std::string& extension : model.extensionsRequired)
    if (!harmless(extension) && !(instancing && extension == kGpuInstancing))
      return invalid_input("it requires the extension " + extension + ", which is not supported" +
                           (extension == kGpuInstancing ? " without instances" : ""));
  return {};
}

/// Appends the triangles of a mesh.
build::Result<void> append(Mesh& mesh, const tinygltf::Model& model, int index, const Transform& to_world) {
  const auto& primitives = model.meshes[static_cast<std::size_t>(index)].primitives;
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    if (interrupted()) return cancelled_error();
    if (!has_triangles(primitives[i])) continue;
    const auto part = read_part(model, primitives[i]);
    if (!part)
      return invalid_input("mesh " + std::to_string(index) + ", primitive " + std::to_string(i) + ": " +
                           part.error().message);
    if (auto done = append(mesh, *part, to_world); !done) return done;
  }
  return {};
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
    if (interrupted()) return cancelled_error();
    animation->pose(static_cast<double>(time), model);
    if (auto added = add(); !added) return tl::unexpected(added.error());
  }
  return poses;
}

}  // namespace

build::Result<Mesh> read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder) {
  tinygltf::Model model;
  Mesh mesh;
  if (auto loaded = load(bytes, folder, false, model, mesh.files); !loaded) return tl::unexpected(loaded.error());
  const auto uses = flatten(model);
  if (!uses) return tl::unexpected(uses.error());
  for (const NodeMesh& use : *uses)
    if (auto done = append(mesh, model, use.mesh, use.to_world); !done) return tl::unexpected(done.error());
  return mesh;
}

build::Result<MeshAssembly> read_gltf_assembly(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                                               const std::string& name, const std::vector<float>& times) {
  tinygltf::Model model;
  MeshAssembly result;
  if (auto loaded = load(bytes, folder, true, model, result.files); !loaded) return tl::unexpected(loaded.error());
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
      if (auto done = append(mesh, model, node.mesh, Transform{}); !done) return tl::unexpected(done.error());
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
  return result;
}

}  // namespace hiprt::tools
