#include <tools/scene_io/mesh/mesh_assimp.h>

#include <tools/base/errors.h>

#include <algorithm>
#include <array>
#include <string_view>

#ifdef HIPRT_HAS_ASSIMP
#include <tools/base/interrupt.h>
#include <tools/scene_io/ignored.h>
#include <tools/scene_io/mesh/append_mesh.h>
#include <tools/scene_io/mesh/polygons.h>

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/version.h>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>

#include <memory>
#include <optional>
#include <utility>
#include <vector>
#endif

namespace hiprt::tools {
namespace {

/// What users know these extensions by.
constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kKnown{{{".fbx", "FBX"},
                                                                               {".3ds", "3DS"},
                                                                               {".dae", "COLLADA"},
                                                                               {".usd", "USD"},
                                                                               {".usda", "USD"},
                                                                               {".usdc", "USD"},
                                                                               {".usdz", "USD"}}};

}  // namespace

#ifdef HIPRT_HAS_ASSIMP
namespace {

std::string assimp() { return "assimp " + assimp_version(); }

/// Lets a signal end the import.
class Cancel : public Assimp::ProgressHandler {
 public:
  bool Update(float) override { return !interrupted(); }
};

Transform to_double(const aiMatrix4x4& m) {
  Transform result;
  for (unsigned row = 0; row < 3; ++row)
    for (unsigned column = 0; column < 4; ++column) result.m[row][column] = static_cast<double>(m[row][column]);
  return result;
}

/// A scene of assimp's, as meshes and their uses.
class AssimpReader {
 public:
  AssimpReader(const aiScene& scene, std::string name) : scene_(scene), name_(std::move(name)) {}

  build::Result<MeshAssembly> read() {
    if (auto done = read_meshes(); !done) return tl::unexpected(done.error());
    if (auto done = read_nodes(); !done) return tl::unexpected(done.error());
    ignored_.add("materials", scene_.mNumMaterials);
    ignored_.add("animations", scene_.mNumAnimations);
    ignored_.add("cameras", scene_.mNumCameras);
    ignored_.add("lights", scene_.mNumLights);
    ignored_.add("embedded textures", scene_.mNumTextures);
    result_.warnings.push_back("read by " + assimp() + ", which accepts some damaged files");
    ignored_.warn(result_.warnings);
    return std::move(result_);
  }

 private:
  build::Result<void> read_meshes() {
    for (unsigned i = 0; i < scene_.mNumMeshes; ++i) {
      auto mesh = read_mesh(*scene_.mMeshes[i]);
      if (!mesh) return fail(mesh.error().code, "mesh " + std::to_string(i) + ": " + mesh.error().message);
      numbers_.emplace_back();
      if (mesh->triangles.empty()) continue;
      numbers_.back() = result_.meshes.size();
      mesh->name = name_ + " mesh " + std::to_string(i);
      result_.meshes.push_back(std::move(*mesh));
    }
    return {};
  }

  build::Result<Mesh> read_mesh(const aiMesh& from) {
    ignored_.add("skins", from.HasBones() ? 1 : 0);
    ignored_.add("morph targets", from.mNumAnimMeshes);
    Mesh mesh;
    mesh.positions.reserve(from.mNumVertices);
    for (unsigned i = 0; i < from.mNumVertices; ++i) {
      const aiVector3D& v = from.mVertices[i];
      mesh.positions.push_back({static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)});
    }
    Polygons faces;
    for (unsigned i = 0; i < from.mNumFaces; ++i) {
      if (interrupted_at(i)) return cancelled();
      const aiFace& face = from.mFaces[i];
      if (face.mNumIndices < 3) {
        ignored_.add(face.mNumIndices == 2 ? "lines" : "points");
        continue;
      }
      faces.sizes.push_back(face.mNumIndices);
      faces.corners.insert(faces.corners.end(), face.mIndices, face.mIndices + face.mNumIndices);
    }
    auto triangles = triangulate(mesh.positions, faces, mesh.skipped_faces);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh.triangles = std::move(*triangles);
    return mesh;
  }

  /// Depth first, in the order of the file.
  build::Result<void> read_nodes() {
    std::vector<std::pair<const aiNode*, Transform>> stack;
    if (scene_.mRootNode != nullptr) stack.emplace_back(scene_.mRootNode, Transform{});
    while (!stack.empty()) {
      if (interrupted()) return cancelled();
      const auto [node, parent] = stack.back();
      stack.pop_back();
      const Transform to_world = parent * to_double(node->mTransformation);
      for (unsigned i = 0; i < node->mNumMeshes; ++i) {
        if (node->mMeshes[i] >= numbers_.size())
          return invalid_input("a node uses mesh " + std::to_string(node->mMeshes[i]) + ", there are " +
                               std::to_string(numbers_.size()));
        if (const auto number = numbers_[node->mMeshes[i]]) result_.uses.push_back({*number, to_world});
      }
      for (unsigned i = node->mNumChildren; i > 0; --i) stack.emplace_back(node->mChildren[i - 1], to_world);
    }
    return {};
  }

  const aiScene& scene_;
  std::string name_;
  MeshAssembly result_;
  std::vector<std::optional<std::size_t>> numbers_;  ///< In the assembly, by assimp's; nothing: without triangles.
  Ignored ignored_;
};

}  // namespace

std::string assimp_version() {
  return std::to_string(aiGetVersionMajor()) + "." + std::to_string(aiGetVersionMinor()) + "." +
         std::to_string(aiGetVersionPatch());
}

bool assimp_reads(const std::string& extension) {
  return extension.size() > 1 && Assimp::Importer().IsExtensionSupported(extension);
}

build::Result<MeshAssembly> read_assimp_assembly(std::span<const std::byte> bytes, const std::string& extension,
                                                 const std::string& name) {
  Assimp::Importer importer;
  importer.SetProgressHandler(std::make_unique<Cancel>().release());  // The importer deletes it.
  // Some readers make scenes with missing nodes: they must be refused before anybody follows the pointers.
  const aiScene* scene =
      importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_ValidateDataStructure, extension.c_str() + 1);
  if (interrupted()) return cancelled();
  const std::string_view error = importer.GetErrorString();
  if (error.find("bad_alloc") != std::string_view::npos || error.find("bad alloc") != std::string_view::npos)
    throw std::bad_alloc();
  if (scene == nullptr)
    return invalid_input(assimp() + " cannot read it: " + std::string(error.empty() ? "no reason given" : error));
  return AssimpReader(*scene, name).read();
}

build::Result<Mesh> read_assimp(std::span<const std::byte> bytes, const std::string& extension) {
  auto assembly = read_assimp_assembly(bytes, extension, "");
  if (!assembly) return tl::unexpected(assembly.error());
  Mesh mesh;
  mesh.warnings = std::move(assembly->warnings);
  for (const Mesh& part : assembly->meshes) mesh.skipped_faces += part.skipped_faces;
  for (const MeshUse& use : assembly->uses) {
    if (interrupted()) return cancelled();
    const Mesh& part = assembly->meshes[use.mesh];
    auto done = append(mesh, part.positions, part.triangles, use.to_world);
    if (!done) return tl::unexpected(std::move(done.error()));
  }
  return mesh;
}

build::Error no_reader(const std::string& extension) {
  const auto* known = std::find_if(kKnown.begin(), kKnown.end(), [&](const auto& k) { return k.first == extension; });
  if (known != kKnown.end())
    return {build::ErrorCode::kInvalidInput,
            std::string(known->second) + " is not among the formats of " + assimp() + ": convert the file to glTF"};
  return {build::ErrorCode::kInvalidInput,
          "unknown mesh format; known are .obj, .ply, .stl, .gltf, .glb, .mesh, .mesh.zst, and those of " + assimp()};
}
#else
std::string assimp_version() { return "not compiled in (HIPRT_ASSIMP)"; }
bool assimp_reads(const std::string&) { return false; }
build::Result<MeshAssembly> read_assimp_assembly(std::span<const std::byte>, const std::string& extension,
                                                 const std::string&) {
  return tl::unexpected(no_reader(extension));
}
build::Result<Mesh> read_assimp(std::span<const std::byte>, const std::string& extension) {
  return tl::unexpected(no_reader(extension));
}

build::Error no_reader(const std::string& extension) {
  const auto* known = std::find_if(kKnown.begin(), kKnown.end(), [&](const auto& k) { return k.first == extension; });
  if (known == kKnown.end())
    return {build::ErrorCode::kInvalidInput,
            "unknown mesh format; known are .obj, .ply, .stl, .gltf, .glb, .mesh and .mesh.zst"};
  return {build::ErrorCode::kInvalidInput, std::string(known->second) +
                                               " needs assimp, which this build does not have: build with "
                                               "-DHIPRT_ASSIMP=ON, or convert the file to glTF"};
}
#endif

}  // namespace hiprt::tools
