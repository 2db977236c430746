#pragma once
/// Textures of a glTF file: images, how they go on outside, and where they lie.

#include <tools/scene_io/ignored.h>
#include <tools/scene_io/json_location.h>
#include <tools/scene_io/surface/material_library.h>

#include <hiprt_build/error.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

/// Reads the textures that materials use, every image once.
class GltfTextures {
 public:
  /// All but @p folder have to outlive it.
  /// @param document the file's JSON. @param model of the same file, for buffers. @param folder where relative names
  /// lead to. @param library gets the textures. @param ignored counts what is left out.
  GltfTextures(const nlohmann::json& document, const tinygltf::Model& model, std::filesystem::path folder,
               MaterialLibrary& library, Ignored& ignored);

  /// Throws JsonFault.
  /// @param location of @p info, a textureInfo (glTF 2.0, 5.30), with KHR_texture_transform.
  /// @return no texture if it has other coordinates than TEXCOORD_0. With the image in the message: kIo, kInvalidInput
  /// (a damaged file), kTooLarge.
  build::Result<TextureUse> use(const JsonLocation& location, const nlohmann::json& info);

  /// Paths of the images' files that were read.
  const std::vector<std::string>& files() const { return files_; }

 private:
  build::Result<std::uint32_t> texture_of(std::size_t image);
  build::Result<Texture> read(std::size_t image);

  const nlohmann::json& document_;
  const tinygltf::Model& model_;
  std::filesystem::path folder_;
  MaterialLibrary& library_;
  Ignored& ignored_;
  std::map<std::size_t, std::uint32_t> numbers_;  ///< In the library, by image.
  std::vector<std::string> files_;
};

/// A member of an object; nullptr: it is not there.
const nlohmann::json* json_member(const nlohmann::json& object, const char* key);

/// Item @p index of a list of the document. Throws JsonFault: it is not there.
/// @param location of the index.
const nlohmann::json& json_item(const JsonLocation& location, const nlohmann::json& document, const char* list,
                                std::uint32_t index);

}  // namespace hiprt::tools
