#pragma once
/// Where the bytes of a glTF file's images are.

#include <tools/scene_io/json_location.h>

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace tinygltf {
class Model;
}

namespace hiprt::tools {

/// A file (PNG, JPEG) in memory.
struct ImageBytes {
  build::Buffer file{};                  ///< Of a file.
  std::vector<unsigned char> decoded{};  ///< Of a data URI.
  std::span<const std::byte> bytes{};    ///< In one of them, or in a buffer of the model.
  std::string path{};                    ///< Path of the file, if the image has one.
};

/// For messages: "image 'leaf.png'"; "image 3" of one without file and name.
std::string image_label(const nlohmann::json& image, std::size_t index);

/// The bytes that an image has in a file, a data URI or a bufferView. Throws JsonFault.
/// @param location of @p image. @param folder where relative names lead to. @param model for buffers; has to outlive
/// the result.
/// @return kIo: there is no regular file that can be read; kInvalidInput.
build::Result<ImageBytes> read_image_bytes(const JsonLocation& location, const nlohmann::json& image,
                                           const tinygltf::Model& model, const std::filesystem::path& folder);

}  // namespace hiprt::tools
