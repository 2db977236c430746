#include <tools/scene_io/gltf/gltf_image.h>

#include <tools/base/errors.h>
#include <tools/base/read_input.h>
#include <tools/base/text.h>
#include <tools/scene_io/gltf/gltf_buffers.h>

#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#include <utility>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kDataUri = "data:";

build::Result<ImageBytes> picture_of_data_uri(const std::string& uri) {
  if (!tinygltf::IsDataURI(uri)) return invalid_input("its data URI is not base64 of image/png or image/jpeg");
  ImageBytes result;
  std::string ignored;
  if (!tinygltf::DecodeDataURI(&result.decoded, ignored, uri, 0, false))
    return invalid_input("its data URI is empty or damaged");
  result.bytes = std::as_bytes(std::span(result.decoded));
  return result;
}

build::Result<ImageBytes> from_file(const JsonLocation& location, const std::string& uri,
                                    const std::filesystem::path& folder) {
  const std::string name = decode_percents(uri);
  if (name.empty() || name.find('\0') != std::string::npos) json_fault(location, "not the name of a file");
  // As tinygltf joins the names of buffers: what begins with a slash stays in the folder.
  const std::filesystem::path path = folder / std::filesystem::path(name).relative_path();
  auto file = read_input(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  ImageBytes result{.file = std::move(*file), .path = path.string()};
  result.bytes = std::as_const(result.file).bytes();
  return result;
}

build::Result<ImageBytes> from_view(const JsonLocation& location, const Json& value, const tinygltf::Model& model) {
  const std::uint32_t index = json_uint32(location, value);
  if (index >= model.bufferViews.size())
    json_fault(location, std::to_string(index) + ", there are " + std::to_string(model.bufferViews.size()));
  const tinygltf::BufferView& view = model.bufferViews[index];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size())
    return invalid_input("bufferView " + std::to_string(index) + ": buffer " + std::to_string(view.buffer) +
                         " does not exist");
  const std::vector<unsigned char>& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    return invalid_input("bufferView " + std::to_string(index) + " ends behind its buffer's " +
                         std::to_string(data.size()) + " bytes");
  ImageBytes result;
  result.bytes = std::as_bytes(std::span(data).subspan(view.byteOffset, view.byteLength));
  return result;
}

}  // namespace

std::string image_label(const Json& image, std::size_t index) {
  for (const char* key : {"uri", "name"}) {
    const auto value = image.is_object() ? image.find(key) : image.end();
    if (value == image.end() || !value->is_string()) continue;
    const auto& text = value->get_ref<const std::string&>();
    if (!text.empty() && !text.starts_with(kDataUri)) return "image " + in_quotes(text);
  }
  return "image " + std::to_string(index);
}

build::Result<ImageBytes> read_image_bytes(const JsonLocation& location, const Json& image,
                                           const tinygltf::Model& model, const std::filesystem::path& folder) {
  json_object(location, image);
  const auto view = image.find("bufferView"), uri = image.find("uri");
  if (view != image.end()) return from_view(JsonLocation(location, "bufferView"), *view, model);
  if (uri == image.end()) json_fault(location, "it has neither 'uri' nor 'bufferView'");
  const JsonLocation at(location, "uri");
  const std::string& text = json_string(at, *uri);
  return text.starts_with(kDataUri) ? picture_of_data_uri(text) : from_file(at, text, folder);
}

}  // namespace hiprt::tools
