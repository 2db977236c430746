/// KHR_draco_mesh_compression through Draco.

#include <tools/scene_io/gltf/gltf_compression.h>
#include <tools/scene_io/gltf/gltf_extensions.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/scene_io/json_location.h>

#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#ifdef HIPRT_HAS_DECODER
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#include <draco/compression/decode.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif
#endif

#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

namespace hiprt::tools {

#ifdef HIPRT_HAS_DECODER
bool has_draco() { return true; }

namespace {

using Json = nlohmann::json;

/// Appends a buffer of decoded elements and gives it to an accessor.
void place(tinygltf::Model& model, tinygltf::Accessor& accessor, std::vector<unsigned char> bytes) {
  tinygltf::BufferView view;
  view.buffer = static_cast<int>(model.buffers.size());
  view.byteLength = bytes.size();
  accessor.bufferView = static_cast<int>(model.bufferViews.size());
  accessor.byteOffset = 0;
  accessor.sparse.isSparse = false;
  model.bufferViews.push_back(std::move(view));
  tinygltf::Buffer buffer;
  buffer.data = std::move(bytes);
  model.buffers.push_back(std::move(buffer));
}

/// The values of all points as numbers of type T.
template <class T>
std::vector<unsigned char> values_of(const draco::PointAttribute& attribute, std::size_t points, unsigned components) {
  std::vector<unsigned char> bytes(points * components * sizeof(T));
  std::array<T, 4> value{};
  for (std::size_t i = 0; i < points; ++i) {
    const auto index = attribute.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));
    attribute.ConvertValue<T>(index, static_cast<std::int8_t>(components), value.data());
    std::memcpy(&bytes[i * components * sizeof(T)], value.data(), components * sizeof(T));
  }
  return bytes;
}

std::vector<unsigned char> values_of(const draco::PointAttribute& attribute, std::size_t points, unsigned components,
                                     int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return values_of<std::int8_t>(attribute, points, components);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return values_of<std::uint8_t>(attribute, points, components);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return values_of<std::int16_t>(attribute, points, components);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return values_of<std::uint16_t>(attribute, points, components);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return values_of<std::uint32_t>(attribute, points, components);
    default:
      return values_of<float>(attribute, points, components);
  }
}

std::span<const unsigned char> data_of(const JsonLocation& location, const Json& extension,
                                       const tinygltf::Model& model) {
  const JsonLocation at(location, "bufferView");
  const auto value = json_object(location, extension).find("bufferView");
  const std::uint32_t number = value == extension.end() ? 0xffffffffu : json_uint32(at, *value);
  if (number >= model.bufferViews.size())
    json_fault(at, "there are " + std::to_string(model.bufferViews.size()) + " bufferViews");
  const tinygltf::BufferView& view = model.bufferViews[number];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size())
    json_fault(at, "buffer " + std::to_string(view.buffer) + " does not exist");
  const std::span<const unsigned char> data(model.buffers[static_cast<std::size_t>(view.buffer)].data);
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    json_fault(at, "ends behind its buffer's " + std::to_string(data.size()) + " bytes");
  return data.subspan(view.byteOffset, view.byteLength);
}

std::unique_ptr<draco::Mesh> decode(const JsonLocation& location, std::span<const unsigned char> data) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(data.data()), data.size());
  draco::Decoder decoder;
  auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
  if (!mesh.ok()) json_fault(location, "its compressed data is damaged: " + mesh.status().error_msg_string());
  return std::move(mesh).value();
}

void take_attributes(const JsonLocation& location, const Json& attributes, const draco::Mesh& mesh,
                     const tinygltf::Primitive& primitive, tinygltf::Model& model) {
  for (const auto& [name, id] : json_object(location, attributes).items()) {
    const JsonLocation at(location, name);
    const auto* attribute = mesh.GetAttributeByUniqueId(json_uint32(at, id));
    const auto number = primitive.attributes.find(name);
    if (attribute == nullptr) json_fault(at, "the compressed data has no such attribute");
    if (number == primitive.attributes.end() || number->second < 0 ||
        static_cast<std::size_t>(number->second) >= model.accessors.size())
      json_fault(at, "the primitive has no accessor of that name");
    tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(number->second)];
    if (accessor.count != mesh.num_points())
      json_fault(at, std::to_string(mesh.num_points()) + " points, but accessor " + std::to_string(number->second) +
                         " has " + std::to_string(accessor.count) + " elements");
    const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
    if (components < 1 || components > 4) json_fault(at, "its accessor has neither numbers nor vectors");
    place(model, accessor,
          values_of(*attribute, mesh.num_points(), static_cast<unsigned>(components), accessor.componentType));
  }
}

void take_faces(const draco::Mesh& mesh, tinygltf::Primitive& primitive, tinygltf::Model& model) {
  std::vector<unsigned char> bytes;
  bytes.reserve(std::size_t{12} * mesh.num_faces());
  for (std::uint32_t i = 0; i < mesh.num_faces(); ++i)
    for (const draco::PointIndex& corner : mesh.face(draco::FaceIndex(i))) {
      const std::uint32_t value = corner.value();
      const auto* const first = reinterpret_cast<const unsigned char*>(&value);
      bytes.insert(bytes.end(), first, first + sizeof(value));
    }
  tinygltf::Accessor accessor;
  accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  accessor.type = TINYGLTF_TYPE_SCALAR;
  accessor.count = std::size_t{3} * mesh.num_faces();
  place(model, accessor, std::move(bytes));
  primitive.indices = static_cast<int>(model.accessors.size());
  primitive.mode = TINYGLTF_MODE_TRIANGLES;  // Strips, too, are compressed as triangles.
  model.accessors.push_back(std::move(accessor));
}

void decode_primitive(const JsonLocation& outer, const Json& source, tinygltf::Primitive& primitive,
                      tinygltf::Model& model) {
  const auto extensions = source.find("extensions");
  if (extensions == source.end() || !extensions->is_object() || !extensions->contains(kDraco)) return;
  const JsonLocation all(outer, "extensions"), location(all, kDraco), attributes(location, "attributes");
  const Json& extension = (*extensions)[std::string(kDraco)];
  const auto mesh = decode(location, data_of(location, extension, model));
  if (!extension.contains("attributes")) json_fault(attributes, "they are missing");
  take_attributes(attributes, extension["attributes"], *mesh, primitive, model);
  take_faces(*mesh, primitive, model);
}

}  // namespace

build::Result<void> decode_draco(const Json& document, tinygltf::Model& model) try {
  const JsonLocation root, list(root, "meshes");
  for (std::size_t m = 0; m < model.meshes.size(); ++m) {
    const JsonLocation mesh(list, m), primitives(mesh, "primitives");
    for (std::size_t p = 0; p < model.meshes[m].primitives.size(); ++p) {
      if (interrupted()) return cancelled();
      decode_primitive(JsonLocation(primitives, p), document["meshes"][m]["primitives"][p],
                       model.meshes[m].primitives[p], model);
    }
  }
  return {};
} catch (const JsonFault& fault) {
  return invalid_input(fault.message);
}
#else
bool has_draco() { return false; }
build::Result<void> decode_draco(const nlohmann::json&, tinygltf::Model&) { return {}; }
#endif

}  // namespace hiprt::tools
