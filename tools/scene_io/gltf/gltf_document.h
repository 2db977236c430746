#pragma once
/// A glTF file in memory: its JSON, its buffers, and what its surfaces look like.

#include <tools/scene_io/gltf/gltf_material.h>
#include <tools/scene_io/ignored.h>

#include <hiprt_build/error.h>

#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hiprt::tools {

struct GltfDocument {
  nlohmann::json json;
  tinygltf::Model model;  ///< With the buffers, decompressed; without images, materials and extras.
  std::optional<GltfMaterials> materials;
  Ignored ignored;                 ///< Counts what readers leave out.
  std::vector<std::string> files;  ///< Paths of other files that were read.
};

/// Reads a document, which has to stay at its address while its materials are used.
/// @param instancing does the caller read EXT_mesh_gpu_instancing? @param library nullptr: materials are not read.
/// @return kInvalidInput, kIo or kTooLarge with the location.
build::Result<void> load_document(std::span<const std::byte> file, const std::filesystem::path& folder, bool instancing,
                                  MaterialLibrary* library, GltfDocument& document);

}  // namespace hiprt::tools
