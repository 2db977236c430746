/// STL, ASCII and binary, through assimp.

#include "mesh_formats.h"
#include "text.h"

#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

#include <cstring>

namespace hiprt::tools {
namespace {

/// assimp takes an ASCII file that ends between two facets for a whole one.
bool ends_with_endsolid(std::string_view text) {
  while (!text.empty() && (is_blank(text.back()) || text.back() == '\n' || text.back() == '\0')) text.remove_suffix(1);
  std::string_view line = text.substr(text.rfind('\n') + 1);
  return next_word(line) == "endsolid";
}

/// @return whether the file has facets at all; assimp refuses files without.
build::Result<bool> check_size(std::span<const std::byte> bytes) {
  constexpr std::uint64_t kHeaderBytes = 84, kFacetBytes = 50;
  const std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  std::uint32_t facets = 0;
  if (bytes.size() >= kHeaderBytes) std::memcpy(&facets, bytes.data() + 80, sizeof(facets));
  const std::uint64_t expected = kHeaderBytes + kFacetBytes * facets;
  if (bytes.size() == expected) return facets != 0;
  if (text.starts_with("solid")) {
    if (ends_with_endsolid(text)) return text.find("facet ") != std::string_view::npos;
    return invalid_input("truncated: the last line of an ASCII STL file must start with 'endsolid'");
  }
  if (bytes.size() < kHeaderBytes)
    return invalid_input(std::to_string(bytes.size()) + " bytes are too few for the header of a binary STL file, 84");
  return invalid_input("the header says " + std::to_string(facets) + " facets, which takes " +
                       std::to_string(expected) + " bytes, but the file has " + std::to_string(bytes.size()));
}

void append(Mesh& mesh, const aiMesh& part) {
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i)
    mesh.positions.push_back({part.mVertices[i].x, part.mVertices[i].y, part.mVertices[i].z});
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices == 3)
      mesh.triangles.push_back({base + face.mIndices[0], base + face.mIndices[1], base + face.mIndices[2]});
    else
      ++mesh.skipped_faces;
  }
}

}  // namespace

build::Result<Mesh> read_stl(std::span<const std::byte> bytes) {
  const auto has_facets = check_size(bytes);
  if (!has_facets) return tl::unexpected(has_facets.error());
  if (!*has_facets) return Mesh{};
  Assimp::Importer importer;
  // No post-processing: order, NaN and degenerate facets stay as they are.
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, "stl");
  if (scene == nullptr) return invalid_input(std::string("not an STL file: ") + importer.GetErrorString());
  Mesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    if (mesh.positions.size() + scene->mMeshes[i]->mNumVertices > 0xffffffffu)
      return tl::unexpected(build::Error{build::ErrorCode::kTooLarge, "more than 4294967295 corners"});
    append(mesh, *scene->mMeshes[i]);
  }
  return mesh;
}

}  // namespace hiprt::tools
