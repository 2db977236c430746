#include <tools/scene_io/gltf/gltf_texture.h>

#include <tools/base/interrupt.h>
#include <tools/scene_io/gltf/gltf_image.h>
#include <tools/scene_io/surface/picture.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <utility>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

TextureWrap wrap_of(const JsonLocation& location, const Json& sampler, const char* key) {
  constexpr std::uint32_t kRepeat = 10497, kClampToEdge = 33071, kMirroredRepeat = 33648;  // OpenGL's.
  const Json* value = json_member(sampler, key);
  if (value == nullptr) return TextureWrap::kRepeat;
  const JsonLocation at(location, key);
  switch (const std::uint32_t mode = json_uint32(at, *value)) {
    case kRepeat:
      return TextureWrap::kRepeat;
    case kClampToEdge:
      return TextureWrap::kClamp;
    case kMirroredRepeat:
      return TextureWrap::kMirror;
    default:
      json_fault(at, std::to_string(mode) + ", known are 10497, 33071 and 33648");
  }
}

/// Number of the set of texture coordinates that an object names, or else @p otherwise.
std::uint32_t coordinates_of(const JsonLocation& location, const Json& object, std::uint32_t otherwise) {
  const Json* value = json_member(object, "texCoord");
  return value == nullptr ? otherwise : json_uint32(JsonLocation(location, "texCoord"), *value);
}

/// Scale, then rotation (counter-clockwise as one sees coordinates with v down), then offset.
std::array<float, 6> matrix_of(const JsonLocation& location, const Json& transform) {
  std::array<double, 2> offset{0, 0}, scale{1, 1};
  double rotation = 0;
  if (const Json* value = json_member(transform, "offset"))
    offset = json_numbers<2>(JsonLocation(location, "offset"), *value);
  if (const Json* value = json_member(transform, "scale"))
    scale = json_numbers<2>(JsonLocation(location, "scale"), *value);
  if (const Json* value = json_member(transform, "rotation"))
    rotation = json_number(JsonLocation(location, "rotation"), *value);
  const double c = std::cos(rotation), s = std::sin(rotation);
  const std::array<double, 6> rows{c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
  std::array<float, 6> result{};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    result[i] = static_cast<float>(rows[i]);
    if (!std::isfinite(result[i])) json_fault(location, "it has numbers that single precision cannot hold");
  }
  return result;
}

}  // namespace

const Json* json_member(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

const Json& json_item(const JsonLocation& location, const Json& document, const char* list, std::uint32_t index) {
  const Json* items = json_member(document, list);
  const std::size_t count = items == nullptr ? 0 : json_array(JsonLocation(JsonLocation(), list), *items).size();
  if (index >= count) json_fault(location, std::to_string(index) + ", there are " + std::to_string(count) + " " + list);
  return (*items)[index];
}

GltfTextures::GltfTextures(const Json& document, const tinygltf::Model& model, std::filesystem::path folder,
                           MaterialLibrary& library, Ignored& ignored)
    : document_(document), model_(model), folder_(std::move(folder)), library_(library), ignored_(ignored) {}

build::Result<TextureUse> GltfTextures::use(const JsonLocation& location, const Json& info) {
  TextureUse result;
  json_object(location, info);
  std::uint32_t coordinates = coordinates_of(location, info, 0);
  const JsonLocation extensions_location(location, "extensions"),
      transform_location(extensions_location, "KHR_texture_transform");
  if (const Json* extensions = json_member(info, "extensions"))
    if (const Json* transform = json_member(json_object(extensions_location, *extensions), "KHR_texture_transform")) {
      coordinates = coordinates_of(transform_location, json_object(transform_location, *transform), coordinates);
      result.matrix = matrix_of(transform_location, *transform);
    }
  if (coordinates != 0) {
    ignored_.add("textures with coordinates other than TEXCOORD_0");
    return result;
  }
  const JsonLocation index_location(location, "index");
  const Json* index = json_member(info, "index");
  if (index == nullptr) json_fault(index_location, "it is missing");
  const std::uint32_t number = json_uint32(index_location, *index);
  const Json& texture = json_item(index_location, document_, "textures", number);
  const JsonLocation root, textures_location(root, "textures"), texture_location(textures_location, number);
  json_object(texture_location, texture);
  if (const Json* value = json_member(texture, "sampler")) {
    const JsonLocation at(texture_location, "sampler"), samplers_location(root, "samplers");
    const std::uint32_t sampler_number = json_uint32(at, *value);
    const JsonLocation sampler_location(samplers_location, sampler_number);
    const Json& sampler = json_object(sampler_location, json_item(at, document_, "samplers", sampler_number));
    result.wrap_u = wrap_of(sampler_location, sampler, "wrapS");
    result.wrap_v = wrap_of(sampler_location, sampler, "wrapT");
  }
  const Json* source = json_member(texture, "source");
  const JsonLocation source_location(texture_location, "source");
  if (source == nullptr) json_fault(source_location, "it is missing, and images of extensions are not read");
  const std::uint32_t image = json_uint32(source_location, *source);
  json_item(source_location, document_, "images", image);
  const auto found = texture_of(image);
  if (!found) return tl::unexpected(found.error());
  result.texture = *found;
  return result;
}

build::Result<std::uint32_t> GltfTextures::texture_of(std::size_t image) {
  if (const auto known = numbers_.find(image); known != numbers_.end()) return known->second;
  if (interrupted()) return cancelled();
  const std::string label = image_label(document_["images"][image], image);
  auto texture = read(image);
  if (!texture) return tl::unexpected(build::Error{texture.error().code, label + ": " + texture.error().message});
  texture->name = label;
  const auto number = static_cast<std::uint32_t>(library_.textures.size());
  library_.texels += texture->texels.size();
  library_.textures.push_back(std::move(*texture));
  numbers_.emplace(image, number);
  return number;
}

build::Result<Texture> GltfTextures::read(std::size_t image) {
  const JsonLocation root, images_location(root, "images"), location(images_location, image);
  const auto bytes = read_image_bytes(location, document_["images"][image], model_, folder_);
  if (!bytes) return tl::unexpected(bytes.error());
  if (!bytes->path.empty()) files_.push_back(bytes->path);
  return decode_picture(bytes->bytes, kMostTexels - library_.texels);
}

}  // namespace hiprt::tools
