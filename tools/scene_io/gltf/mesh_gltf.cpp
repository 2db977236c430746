/// glTF 2.0 and GLB through tinygltf, which parses the JSON; buffers, accessors and nodes are ours.

#include <tools/base/interrupt.h>
#include <tools/scene_io/gltf/gltf_animation.h>
#include <tools/scene_io/gltf/gltf_deform.h>
#include <tools/scene_io/gltf/gltf_document.h>
#include <tools/scene_io/gltf/gltf_instancing.h>
#include <tools/scene_io/gltf/gltf_part.h>
#include <tools/scene_io/gltf/gltf_scene.h>
#include <tools/scene_io/mesh/mesh_formats.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>

namespace hiprt::tools {
namespace {

/// Appends the triangles of a mesh, deformed and then transformed.
build::Result<void> append(Mesh& mesh, GltfDocument& document, int index, const GltfDeformation& deformation,
                           const Transform& to_world) {
  const auto number = static_cast<std::size_t>(index);
  const auto& primitives = document.model.meshes[number].primitives;
  const bool surfaces = document.materials.has_value();
  if (surfaces && !mesh.surface) mesh.surface.emplace();
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    if (interrupted()) return cancelled();
    if (!has_triangles(primitives[i])) continue;
    auto part = read_part(document.model, primitives[i], surfaces);
    auto done = part ? deform(document.model, primitives[i], deformation, *part) : tl::unexpected(part.error());
    if (!done)
      return fail(done.error().code,
                  "mesh " + std::to_string(index) + ", primitive " + std::to_string(i) + ": " + done.error().message);
    build::Result<std::uint32_t> material = 0;
    if (surfaces && !part->triangles.empty()) material = document.materials->of_primitive(number, i);
    if (!material) return tl::unexpected(material.error());
    if (done = append(mesh, *part, to_world, *material); !done) return done;
  }
  return {};
}

/// Paths of all files that were read.
std::vector<std::string> files_of(const GltfDocument& document) {
  std::vector<std::string> files = document.files;
  if (!document.materials) return files;
  const std::vector<std::string>& images = document.materials->files();
  files.insert(files.end(), images.begin(), images.end());
  return files;
}

/// The nodes at each time; once where they are without animations if there is no time. The model is left as it is at
/// the first time.
build::Result<std::vector<std::vector<NodeMesh>>> poses_of(GltfDocument& document, const std::vector<float>& times,
                                                           std::vector<std::string>& warnings) {
  tinygltf::Model& model = document.model;
  std::vector<std::vector<NodeMesh>> poses;
  const auto add = [&]() -> build::Result<void> {
    auto nodes = flatten(model);
    if (!nodes) return tl::unexpected(nodes.error());
    poses.push_back(std::move(*nodes));
    return {};
  };
  if (times.empty()) {
    document.ignored.add("animations", model.animations.size());
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
  animation->pose(static_cast<double>(times.front()), model);
  animation->warn_of_turns(times, warnings);
  const bool skinned = std::any_of(poses[0].begin(), poses[0].end(), [&](const NodeMesh& node) {
    return model.nodes[static_cast<std::size_t>(node.node)].skin >= 0;
  });
  if (times.size() > 1 && (animation->morphs(times) || (skinned && !animation->empty())))
    warnings.emplace_back(
        "skinned meshes and morph targets do not deform while the shutter is open: they have the shape "
        "of its opening");
  return poses;
}

/// Meshes of an assembly, each read once. Nodes that deform a mesh in their own way have one of their own.
class AssemblyMeshes {
 public:
  AssemblyMeshes(GltfDocument& document, std::string name, const std::vector<Transform>& to_world, MeshAssembly& result)
      : document_(document), name_(std::move(name)), to_world_(to_world), result_(result) {}

  /// The number of a node's mesh in the assembly; nothing if it has no triangles.
  build::Result<std::optional<std::size_t>> number_of(const NodeMesh& node) {
    const bool own = has_own_shape(document_.model, node.node);
    const auto [known, is_new] = numbers_.try_emplace({node.mesh, own ? node.node : -1});
    if (!is_new) return known->second;
    const auto deformation = deformation_of(document_.model, to_world_, node.node);
    if (!deformation) return tl::unexpected(deformation.error());
    Mesh mesh;
    mesh.name = name_ + " mesh " + std::to_string(node.mesh);
    if (own) mesh.name += " of node " + std::to_string(node.node);
    if (auto done = append(mesh, document_, node.mesh, *deformation, Transform{}); !done)
      return tl::unexpected(done.error());
    if (!mesh.triangles.empty()) {
      known->second = result_.meshes.size();
      result_.meshes.push_back(std::move(mesh));
    }
    return known->second;
  }

 private:
  GltfDocument& document_;
  std::string name_;
  const std::vector<Transform>& to_world_;
  MeshAssembly& result_;
  std::map<std::pair<int, int>, std::optional<std::size_t>> numbers_;  ///< By mesh, and node if the shape is its own.
};

}  // namespace

build::Result<Mesh> read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                              MaterialLibrary* library) {
  GltfDocument document;
  Mesh mesh;
  if (auto loaded = load_document(bytes, folder, false, library, document); !loaded)
    return tl::unexpected(loaded.error());
  const auto uses = flatten(document.model);
  if (!uses) return tl::unexpected(uses.error());
  const auto to_world = world_transforms(document.model);
  if (!to_world) return tl::unexpected(to_world.error());
  if (library != nullptr) mesh.surface.emplace();  // Also of a file without nodes.
  for (const NodeMesh& use : *uses) {
    const auto deformation = deformation_of(document.model, *to_world, use.node);
    if (!deformation) return tl::unexpected(deformation.error());
    if (auto done = append(mesh, document, use.mesh, *deformation, use.to_world); !done)
      return tl::unexpected(done.error());
  }
  mesh.files = files_of(document);
  document.ignored.add("animations", document.model.animations.size());
  document.ignored.warn(mesh.warnings);
  return mesh;
}

build::Result<MeshAssembly> read_gltf_assembly(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                                               const std::string& name, const std::vector<float>& times,
                                               MaterialLibrary* library) {
  GltfDocument document;
  MeshAssembly result;
  if (auto loaded = load_document(bytes, folder, true, library, document); !loaded)
    return tl::unexpected(loaded.error());
  const auto poses = poses_of(document, times, result.warnings);
  if (!poses) return tl::unexpected(poses.error());
  const auto to_world = world_transforms(document.model);
  if (!to_world) return tl::unexpected(to_world.error());
  AssemblyMeshes meshes(document, name, *to_world, result);
  for (std::size_t i = 0; i < poses->front().size(); ++i) {
    const NodeMesh& node = poses->front()[i];
    const auto number = meshes.number_of(node);
    if (!number) return tl::unexpected(number.error());
    if (!*number) continue;
    const auto placements = gpu_instances(document.model, node.node);
    if (!placements) return tl::unexpected(placements.error());
    std::vector<Transform> keys;
    for (const std::vector<NodeMesh>& pose : *poses) keys.push_back(pose[i].to_world);
    const bool moves = std::any_of(keys.begin(), keys.end(), [&](const Transform& t) { return t.m != keys[0].m; });
    for (const Transform& placement : *placements) {
      MeshUse& use = result.uses.emplace_back(MeshUse{**number, node.to_world * placement});
      for (std::size_t k = 0; moves && k < keys.size(); ++k) use.keys.push_back(keys[k] * placement);
    }
  }
  result.files = files_of(document);
  document.ignored.warn(result.warnings);
  return result;
}

}  // namespace hiprt::tools
