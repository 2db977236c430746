#pragma once
/// Materials of a glTF file (glTF 2.0, 3.9).

#include <tools/scene_io/gltf/gltf_texture.h>
#include <tools/scene_io/ignored.h>
#include <tools/scene_io/json_location.h>
#include <tools/scene_io/surface/material_library.h>

#include <hiprt_build/error.h>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace hiprt::tools {

/// Reads the materials that primitives have, every one once, into a library: pbrMetallicRoughness, emission (with
/// KHR_materials_emissive_strength), alphaMode. BLEND becomes a cutoff of 0.5: half transparent is there or not.
/// Other extensions of materials, normal and occlusion textures, and doubleSided are not read.
class GltfMaterials {
 public:
  /// @param document the file's JSON. @param model of the same file, for buffers; has to outlive this. @param folder
  /// where relative names of images lead to. @param library, ignored have to outlive this; ignored counts what is left
  /// out.
  GltfMaterials(nlohmann::json document, const tinygltf::Model& model, std::filesystem::path folder,
                MaterialLibrary& library, Ignored& ignored);
  GltfMaterials(const GltfMaterials&) = delete;
  GltfMaterials& operator=(const GltfMaterials&) = delete;

  /// The number in the library of what a primitive has; the standard's default material if it names none.
  /// @pre there is such a primitive.
  /// @return kInvalidInput, kIo, kTooLarge with the material and the location; kCancelled.
  build::Result<std::uint32_t> of_primitive(std::size_t mesh, std::size_t primitive);

  /// Paths of the images' files that were read.
  const std::vector<std::string>& files() const { return textures_.files(); }

 private:
  build::Result<std::uint32_t> number_of(std::int64_t index);
  build::Result<Material> read(const nlohmann::json& source);
  void count_ignored(const nlohmann::json& source);
  build::Result<void> read_textures(const nlohmann::json& source, Material& material);

  nlohmann::json document_;
  MaterialLibrary& library_;
  Ignored& ignored_;
  GltfTextures textures_;
  std::map<std::int64_t, std::uint32_t> numbers_;  ///< In the library, by the file's number; -1: the default.
};

}  // namespace hiprt::tools
