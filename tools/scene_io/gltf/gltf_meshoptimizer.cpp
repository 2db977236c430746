/// EXT_meshopt_compression through meshoptimizer.

#include <tools/scene_io/gltf/gltf_compression.h>
#include <tools/scene_io/gltf/gltf_extensions.h>

#include <tools/base/errors.h>
#include <tools/scene_io/json_location.h>

#include <tiny_gltf.h>
#include <nlohmann/json.hpp>

#ifdef HIPRT_HAS_DECODER
#include <meshoptimizer.h>
#endif

#include <string>
#include <utility>

namespace hiprt::tools {

#ifdef HIPRT_HAS_DECODER
bool has_meshopt() { return true; }

namespace {

using Json = nlohmann::json;

struct Compressed {
  std::span<const unsigned char> data;
  std::size_t count, stride;
  std::string mode, filter;
};

/// Throws JsonFault.
Compressed read(const JsonLocation& location, const Json& extension, const tinygltf::Model& model) {
  json_object(location, extension);
  const auto number = [&](const char* key, std::uint32_t otherwise) {
    const auto value = extension.find(key);
    return value == extension.end() ? otherwise : json_uint32(JsonLocation(location, key), *value);
  };
  const auto word = [&](const char* key, const std::string& otherwise) {
    const auto value = extension.find(key);
    return value == extension.end() ? otherwise : json_string(JsonLocation(location, key), *value);
  };
  const std::uint32_t buffer = number("buffer", 0xffffffffu), offset = number("byteOffset", 0),
                      length = number("byteLength", 0);
  if (buffer >= model.buffers.size())
    json_fault(JsonLocation(location, "buffer"), "there are " + std::to_string(model.buffers.size()) + " buffers");
  const std::span<const unsigned char> data(model.buffers[buffer].data);
  if (offset > data.size() || length > data.size() - offset)
    json_fault(location, "ends behind its buffer's " + std::to_string(data.size()) + " bytes");
  return {data.subspan(offset, length), number("count", 0), number("byteStride", 0), word("mode", ""),
          word("filter", "NONE")};
}

/// Is the data as the extension demands, and can it become so many bytes?
void check(const JsonLocation& location, const Compressed& from) {
  constexpr std::size_t kMostExpansion = 1024, kFew = 4096, kMostStride = 256;
  const bool attributes = from.mode == "ATTRIBUTES";
  if (!attributes && from.mode != "TRIANGLES" && from.mode != "INDICES")
    json_fault(JsonLocation(location, "mode"), "ATTRIBUTES, TRIANGLES or INDICES expected");
  const bool stride_fits = attributes ? from.stride % 4 == 0 && from.stride > 0 && from.stride <= kMostStride
                                      : from.stride == 2 || from.stride == 4;
  if (!stride_fits)
    json_fault(
        JsonLocation(location, "byteStride"),
        std::to_string(from.stride) + (attributes ? ", a multiple of 4 up to 256 expected" : ", 2 or 4 expected"));
  if (from.mode == "TRIANGLES" && from.count % 3 != 0)
    json_fault(JsonLocation(location, "count"), std::to_string(from.count) + ", a multiple of 3 expected");
  const bool filter_fits = from.filter == "NONE" || (attributes && from.filter == "EXPONENTIAL") ||
                           (attributes && from.filter == "OCTAHEDRAL" && (from.stride == 4 || from.stride == 8)) ||
                           (attributes && from.filter == "QUATERNION" && from.stride == 8);
  if (!filter_fits)
    json_fault(JsonLocation(location, "filter"), "'" + from.filter + "' is unknown, or not for its data");
  if (from.count * from.stride > kFew + kMostExpansion * from.data.size())
    json_fault(JsonLocation(location, "count"), std::to_string(from.count) + " elements of " +
                                                    std::to_string(from.stride) + " bytes, but there are only " +
                                                    std::to_string(from.data.size()) + " compressed bytes");
}

std::vector<unsigned char> decode(const JsonLocation& location, const Compressed& from) {
  std::vector<unsigned char> to(from.count * from.stride);
  const int fault =
      from.mode == "ATTRIBUTES"
          ? meshopt_decodeVertexBuffer(to.data(), from.count, from.stride, from.data.data(), from.data.size())
      : from.mode == "TRIANGLES"
          ? meshopt_decodeIndexBuffer(to.data(), from.count, from.stride, from.data.data(), from.data.size())
          : meshopt_decodeIndexSequence(to.data(), from.count, from.stride, from.data.data(), from.data.size());
  if (fault != 0) json_fault(location, "its compressed data is damaged");
  if (from.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(to.data(), from.count, from.stride);
  if (from.filter == "QUATERNION") meshopt_decodeFilterQuat(to.data(), from.count, from.stride);
  if (from.filter == "EXPONENTIAL") meshopt_decodeFilterExp(to.data(), from.count, from.stride);
  return to;
}

}  // namespace

build::Result<void> decode_meshopt(const Json& document, tinygltf::Model& model) try {
  const auto views = document.find("bufferViews");
  const JsonLocation root, list(root, "bufferViews");
  for (std::size_t i = 0; views != document.end() && i < views->size(); ++i) {
    const auto extensions = (*views)[i].find("extensions");
    if (extensions == (*views)[i].end() || !extensions->is_object() || !extensions->contains(kMeshopt)) continue;
    const JsonLocation view(list, i), outer(view, "extensions"), location(outer, kMeshopt);
    const Compressed from = read(location, (*extensions)[std::string(kMeshopt)], model);
    check(location, from);
    tinygltf::Buffer buffer;
    buffer.data = decode(location, from);
    model.bufferViews[i].buffer = static_cast<int>(model.buffers.size());
    model.bufferViews[i].byteOffset = 0;
    model.bufferViews[i].byteLength = buffer.data.size();
    model.bufferViews[i].byteStride = from.mode == "ATTRIBUTES" ? from.stride : 0;
    model.buffers.push_back(std::move(buffer));
  }
  return {};
} catch (const JsonFault& fault) {
  return invalid_input(fault.message);
}
#else
bool has_meshopt() { return false; }
build::Result<void> decode_meshopt(const nlohmann::json&, tinygltf::Model&) { return {}; }
#endif

}  // namespace hiprt::tools
