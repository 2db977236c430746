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
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <utility>

namespace hiprt::tools {
namespace {

/// Appends the triangles of a mesh, deformed and then transformed.
/// @param meshes one for each deformation. The first gets the triangles, all get positions and normals.
build::Result<void> append(std::span<Mesh> meshes, GltfDocument& document, int index,
                           std::span<const GltfDeformation> deformations, const Transform& to_world) {
  const auto number = static_cast<std::size_t>(index);
  const auto& primitives = document.model.meshes[number].primitives;
  const bool surfaces = document.materials.has_value();
  for (Mesh& mesh : meshes)
    if (surfaces && !mesh.surface) mesh.surface.emplace();
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    if (!has_triangles(primitives[i])) continue;
    const auto located = [&](const build::Error& error) {
      return fail(error.code,
                  "mesh " + std::to_string(index) + ", primitive " + std::to_string(i) + ": " + error.message);
    };
    const auto part = read_part(document.model, primitives[i], surfaces);
    if (!part) return located(part.error());
    build::Result<std::uint32_t> material = 0;
    for (std::size_t k = 0; k < meshes.size(); ++k) {
      if (interrupted()) return cancelled();
      GltfPart deformed = *part;
      if (k != 0) {
        deformed.triangles.clear();
        deformed.coordinates.clear();
      }
      if (auto done = deform(document.model, primitives[i], deformations[k], deformed); !done)
        return located(done.error());
      if (k == 0 && surfaces && !part->triangles.empty()) material = document.materials->of_primitive(number, i);
      if (!material) return tl::unexpected(material.error());
      if (auto done = append(meshes[k], deformed, to_world, *material); !done) return done;
    }
  }
  return {};
}

bool is_finite(const build::Position& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

/// Triangles with a vertex that is not finite at some time get three times the same corner: no ray hits them. The
/// vertex becomes 0.
void repair_vertices(Mesh& mesh, std::vector<std::string>& warnings) {
  const std::size_t vertices = mesh.positions.size() / mesh.keys;
  std::vector<bool> wrong(vertices);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    if (!is_finite(mesh.positions[i])) wrong[i % vertices] = true;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    if (wrong[i % vertices]) mesh.positions[i] = {};
  std::uint64_t triangles = 0;
  for (build::Triangle& t : mesh.triangles) {
    if (!wrong[t[0]] && !wrong[t[1]] && !wrong[t[2]]) continue;
    t[1] = t[2] = t[0];
    ++triangles;
  }
  if (triangles != 0)
    warnings.push_back(mesh.name + ": deformed, " + std::to_string(triangles) +
                       " triangles have coordinates that are not finite; they are left out");
}

/// The mesh at all times as one: it deforms, or all are the same.
Mesh joined(std::vector<Mesh>&& at_times, std::vector<std::string>& warnings) {
  Mesh result = std::move(at_times.front());
  const auto same = [&](const Mesh& mesh) {
    return std::memcmp(mesh.positions.data(), result.positions.data(),
                       result.positions.size() * sizeof(build::Position)) == 0;
  };
  if (std::all_of(at_times.begin() + 1, at_times.end(), same)) return result;
  result.keys = static_cast<std::uint32_t>(at_times.size());
  for (auto mesh = at_times.begin() + 1; mesh != at_times.end(); ++mesh) {
    result.positions.insert(result.positions.end(), mesh->positions.begin(), mesh->positions.end());
    if (result.surface)
      result.surface->normals.insert(result.surface->normals.end(), mesh->surface->normals.begin(),
                                     mesh->surface->normals.end());
    *mesh = {};
  }
  repair_vertices(result, warnings);
  return result;
}

/// Paths of all files that were read.
std::vector<std::string> files_of(const GltfDocument& document) {
  std::vector<std::string> files = document.files;
  if (!document.materials) return files;
  const std::vector<std::string>& images = document.materials->files();
  files.insert(files.end(), images.begin(), images.end());
  return files;
}

/// A use of a mesh at each time.
struct PosedNode {
  int node, mesh;
  std::vector<Transform> to_world;
  std::vector<GltfDeformation> deformations;  ///< One, if all nodes deform the mesh alike at all times.
  bool has_own_shape;
};

/// Appends the pose of the nodes.
build::Result<void> add_pose(const tinygltf::Model& model, std::vector<PosedNode>& nodes) {
  const auto uses = flatten(model);
  if (!uses) return tl::unexpected(uses.error());
  const auto to_world = world_transforms(model);
  if (!to_world) return tl::unexpected(to_world.error());
  if (nodes.empty()) {
    const std::vector<bool> own = own_shapes(model);
    for (const NodeMesh& use : *uses)
      nodes.push_back({use.node, use.mesh, {}, {}, own[static_cast<std::size_t>(use.node)]});
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].to_world.push_back((*uses)[i].to_world);
    if (nodes[i].to_world.size() != 1 && !nodes[i].has_own_shape) continue;
    auto deformation = deformation_of(model, *to_world, nodes[i].node);
    if (!deformation) return tl::unexpected(deformation.error());
    nodes[i].deformations.push_back(std::move(*deformation));
  }
  return {};
}

/// The nodes at each time; once where they are without animations if there is no time.
build::Result<std::vector<PosedNode>> poses_of(GltfDocument& document, const std::vector<float>& times,
                                               std::vector<std::string>& warnings) {
  tinygltf::Model& model = document.model;
  std::vector<PosedNode> nodes;
  if (times.empty()) {
    document.ignored.add("animations", model.animations.size());
    if (auto added = add_pose(model, nodes); !added) return tl::unexpected(added.error());
    return nodes;
  }
  const auto animation = Animation::read(model);
  if (!animation) return tl::unexpected(animation.error());
  for (const float time : times) {
    if (interrupted()) return cancelled();
    animation->pose(static_cast<double>(time), model);
    if (auto added = add_pose(model, nodes); !added) return tl::unexpected(added.error());
  }
  animation->warn_of_turns(times, warnings);
  return nodes;
}

/// Meshes of an assembly, each read once. Nodes that deform a mesh in their own way have one of their own.
class AssemblyMeshes {
 public:
  AssemblyMeshes(GltfDocument& document, std::string name, MeshAssembly& result)
      : document_(document), name_(std::move(name)), result_(result) {}

  /// The number of a node's mesh in the assembly; nothing if it has no triangles.
  build::Result<std::optional<std::size_t>> number_of(const PosedNode& node) {
    const auto [known, is_new] = numbers_.try_emplace({node.mesh, node.has_own_shape ? node.node : -1});
    if (!is_new) return known->second;
    std::vector<Mesh> at_times(node.deformations.size());
    at_times[0].name = name_ + " mesh " + std::to_string(node.mesh);
    if (node.has_own_shape) at_times[0].name += " of node " + std::to_string(node.node);
    if (auto done = append(at_times, document_, node.mesh, node.deformations, Transform{}); !done)
      return tl::unexpected(done.error());
    if (!at_times[0].triangles.empty()) {
      known->second = result_.meshes.size();
      result_.meshes.push_back(joined(std::move(at_times), result_.warnings));
    }
    return known->second;
  }

 private:
  GltfDocument& document_;
  std::string name_;
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
    if (auto done = append({&mesh, 1}, document, use.mesh, {&*deformation, 1}, use.to_world); !done)
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
  const auto nodes = poses_of(document, times, result.warnings);
  if (!nodes) return tl::unexpected(nodes.error());
  AssemblyMeshes meshes(document, name, result);
  for (const PosedNode& node : *nodes) {
    const auto number = meshes.number_of(node);
    if (!number) return tl::unexpected(number.error());
    if (!*number) continue;
    const auto placements = gpu_instances(document.model, node.node);
    if (!placements) return tl::unexpected(placements.error());
    const std::vector<Transform>& keys = node.to_world;
    const bool moves = std::any_of(keys.begin(), keys.end(), [&](const Transform& t) { return t.m != keys[0].m; });
    for (const Transform& placement : *placements) {
      MeshUse& use = result.uses.emplace_back(MeshUse{**number, keys[0] * placement});
      for (std::size_t k = 0; moves && k < keys.size(); ++k) use.keys.push_back(keys[k] * placement);
    }
  }
  result.files = files_of(document);
  document.ignored.warn(result.warnings);
  return result;
}

}  // namespace hiprt::tools
