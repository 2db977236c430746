#include <tools/scene_io/gltf/gltf_check.h>

#include <tools/base/errors.h>
#include <tools/base/text.h>
#include <tools/scene_io/gltf/gltf_extensions.h>
#include <tools/scene_io/json_location.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>

namespace hiprt::tools {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kMaxIndex = std::numeric_limits<int>::max();  ///< tinygltf keeps indices as int.
constexpr std::uint64_t kMaxSize = std::numeric_limits<std::int64_t>::max();

constexpr std::size_t kGlbHeader = 12, kChunkHeader = 8;

/// The JSON text of a .gltf or .glb file.
build::Result<std::string_view> json_of(std::string_view file) {
  if (!file.starts_with("glTF")) {
    if (is_utf16(file)) return invalid_input(kUtf16Fault);
    return file;
  }
  if (file.size() < kGlbHeader + kChunkHeader)
    return invalid_input("truncated: the header of a GLB file takes 20 bytes, there are " +
                         std::to_string(file.size()));
  std::array<std::uint32_t, 4> header{};  // Version, length of the file, length and type of the first chunk.
  std::memcpy(header.data(), file.data() + 4, sizeof(header));
  if (header[0] != 2) return invalid_input("GLB of version " + std::to_string(header[0]) + ", only 2 is known");
  const std::size_t left = file.size() - kGlbHeader - kChunkHeader;
  if (header[2] > left)
    return invalid_input("truncated: the JSON chunk has " + std::to_string(header[2]) + " bytes, but only " +
                         std::to_string(left) + " are left");
  if (header[1] > file.size())
    return invalid_input("truncated: the header says " + std::to_string(header[1]) + " bytes, but the file has " +
                         std::to_string(file.size()));
  return file.substr(kGlbHeader + kChunkHeader, header[2]);
}

build::Result<void> check_depth(std::string_view json) {
  std::size_t depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_string = !in_string;
    } else if (!in_string && (c == '[' || c == '{')) {
      if (++depth > kMaxJsonLevels)
        return invalid_input("byte " + std::to_string(i) + " of the JSON: nested deeper than " +
                             std::to_string(kMaxJsonLevels) + " levels");
    } else if (!in_string && (c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return {};
}

/// Some encoders write -1 for an accessor without a bufferView.
void remove_absent_views(Json& document) {
  const auto accessors = document.is_object() ? document.find("accessors") : document.end();
  if (accessors == document.end() || !accessors->is_array()) return;
  for (Json& accessor : *accessors)
    if (accessor.is_object() && accessor.contains("bufferView") && accessor["bufferView"] == -1)
      accessor.erase("bufferView");
}

/// Keeps the first error; checks after it do nothing.
class Checker {
 public:
  build::Result<void> check(const Json& root) {
    if (!root.is_object()) return invalid_input("the JSON is no object");
    check_version(root);
    strings(root, "extensionsRequired");
    index(root, "scene");
    each(root, "buffers", "buffer", [&](const Json& buffer) {
      number(buffer, "byteLength", kMaxSize);
      if (const auto uri = buffer.find("uri"); uri != buffer.end() && !uri->is_string()) fail("uri", *uri, "a string");
    });
    each(root, "bufferViews", "bufferView", [&](const Json& view) {
      index(view, "buffer");
      for (const char* key : {"byteOffset", "byteLength", "byteStride"}) number(view, key, kMaxSize);
    });
    each(root, "accessors", "accessor", [&](const Json& accessor) { check_accessor(accessor); });
    const auto accessors = root.find("accessors");
    accessors_ = accessors == root.end() ? 0 : accessors->size();
    each(root, "meshes", "mesh", [&](const Json& mesh) { check_mesh(mesh); });
    each(root, "nodes", "node", [&](const Json& node) { check_node(node); });
    each(root, "skins", "skin", [&](const Json& skin) {
      index(skin, "inverseBindMatrices");
      if (!skin.contains("joints")) return fail("'joints' are missing");
      indices(skin, "joints");
    });
    each(root, "scenes", "scene", [&](const Json& scene) { indices(scene, "nodes"); });
    if (!error_.empty()) return invalid_input(error_);
    return {};
  }

 private:
  void fail(const std::string& what) {
    if (error_.empty()) error_ = location_.empty() ? what : location_ + ": " + what;
  }

  static std::string quoted(const Json& value) {
    return in_quotes(value.dump(-1, ' ', false, Json::error_handler_t::replace));
  }

  void fail(const char* key, const Json& value, const std::string& expected) {
    fail("'" + std::string(key) + "' is " + quoted(value) + ", not " + expected);
  }

  void whole_number(const char* key, const Json& value, std::uint64_t limit) {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > limit)
      fail(key, value, "a whole number from 0 to " + std::to_string(limit));
  }

  void number(const Json& object, const char* key, std::uint64_t limit) {
    if (const auto value = object.find(key); value != object.end()) whole_number(key, *value, limit);
  }

  void index(const Json& object, const char* key) { number(object, key, kMaxIndex); }

  void indices(const Json& object, const char* key) {
    const auto list = object.find(key);
    if (list == object.end()) return;
    if (!list->is_array()) return fail(key, *list, "a list of numbers");
    for (const Json& value : *list) whole_number(key, value, kMaxIndex);
  }

  void strings(const Json& object, const char* key) {
    const auto list = object.find(key);
    if (list == object.end()) return;
    if (!list->is_array() || !std::all_of(list->begin(), list->end(), [](const Json& v) { return v.is_string(); }))
      fail(key, *list, "a list of strings");
  }

  void reals(const Json& object, const char* key, std::size_t count) {
    const auto list = object.find(key);
    if (list == object.end()) return;
    if (!list->is_array() || list->size() != count ||
        !std::all_of(list->begin(), list->end(), [](const Json& v) { return v.is_number(); }))
      fail(key, *list, "a list of " + std::to_string(count) + " numbers");
  }

  void numbers(const Json& object, const char* key) {
    const auto list = object.find(key);
    if (list != object.end() && list->is_array()) return reals(object, key, list->size());
    if (list != object.end()) fail(key, *list, "a list of numbers");
  }

  /// Sets the location and calls check(object), if the value of @p key is an object.
  template <class Check> void inside(const Json& parent, const char* key, Check&& check) {
    const auto value = parent.find(key);
    if (value == parent.end()) return;
    if (!value->is_object()) return fail(key, *value, "an object");
    at(key, [&] { check(*value); });
  }

  /// Sets the location and calls check(object) for every object of a list.
  template <class Check> void each(const Json& parent, const char* key, const char* noun, Check&& check) {
    const auto list = parent.find(key);
    if (list == parent.end()) return;
    if (!list->is_array()) return fail(key, *list, "a list");
    for (std::size_t i = 0; i < list->size() && error_.empty(); ++i)
      at(noun + (" " + std::to_string(i)), [&] {
        if (!(*list)[i].is_object()) return fail("it is " + quoted((*list)[i]) + ", not an object");
        check((*list)[i]);
      });
  }

  template <class Check> void at(const std::string& location, Check&& check) {
    const std::string outer = location_;
    location_ += (location_.empty() ? "" : ", ") + location;
    check();
    location_ = outer;
  }

  void check_version(const Json& root) {
    const auto asset = root.find("asset");
    if (asset == root.end() || !asset->is_object() || !asset->contains("version"))
      return fail("'asset' with 'version' is missing, which must be \"2.0\"");
    const Json& version = (*asset)["version"];
    const std::string text = version.is_string() ? version.get<std::string>() : std::string();
    if (!text.starts_with("2.") || text.size() < 3 ||
        !std::all_of(text.begin() + 2, text.end(), [](char c) { return c >= '0' && c <= '9'; }))
      fail("the asset's version is " + version.dump(-1, ' ', false, Json::error_handler_t::replace) +
           ", only \"2.0\" and other 2.x are known: convert the file to glTF 2.0");
    // A reader that knows less than this must not load the asset (glTF 2.0, 3.2).
    const auto least = asset->find("minVersion");
    if (least != asset->end() && *least != "2.0")
      fail("the asset needs readers of version " + least->dump(-1, ' ', false, Json::error_handler_t::replace) +
           " (minVersion), and this one knows \"2.0\"");
  }

  void check_accessor(const Json& accessor) {
    index(accessor, "bufferView");
    for (const char* key : {"byteOffset", "count", "componentType"}) number(accessor, key, kMaxSize);
    const auto normalized = accessor.find("normalized");
    if (normalized != accessor.end() && !normalized->is_boolean()) fail("normalized", *normalized, "true or false");
    inside(accessor, "sparse", [&](const Json& sparse) {
      index(sparse, "count");
      for (const char* part : {"indices", "values"})
        inside(sparse, part, [&](const Json& object) {
          for (const char* key : {"bufferView", "byteOffset", "componentType"}) index(object, key);
        });
    });
  }

  void check_mesh(const Json& mesh) {
    if (!mesh.contains("primitives")) return fail("'primitives' are missing");
    each(mesh, "primitives", "primitive", [&](const Json& primitive) {
      constexpr std::uint64_t kTriangleFan = 6;  // The last mode.
      number(primitive, "mode", kTriangleFan);
      number(primitive, "indices", std::max<std::size_t>(accessors_, 1) - 1);
      const auto attributes = primitive.find("attributes");
      if (attributes == primitive.end()) return fail("'attributes' are missing");
      if (!attributes->is_object()) return fail("attributes", *attributes, "an object");
      for (const auto& [key, value] : attributes->items()) whole_number(key.c_str(), value, kMaxIndex);
      each(primitive, "targets", "target", [&](const Json& target) {
        for (const auto& [key, value] : target.items()) whole_number(key.c_str(), value, kMaxIndex);
      });
    });
    numbers(mesh, "weights");
  }

  void check_node(const Json& node) {
    for (const char* key : {"mesh", "skin"}) index(node, key);
    indices(node, "children");
    reals(node, "translation", 3);
    reals(node, "scale", 3);
    reals(node, "rotation", 4);
    reals(node, "matrix", 16);
    numbers(node, "weights");
  }

  std::string location_, error_;
  std::size_t accessors_ = 0;
};

}  // namespace

build::Result<Json> check_gltf(std::span<const std::byte> file) {
  const auto text = json_of({reinterpret_cast<const char*>(file.data()), file.size()});
  if (!text) return tl::unexpected(text.error());
  if (auto done = check_depth(*text); !done) return tl::unexpected(done.error());
  try {
    std::string_view json = *text;
    skip_byte_order_mark(json);
    Json document = Json::parse(json);
    if (auto done = check_required_extensions(document); !done) return tl::unexpected(done.error());
    remove_absent_views(document);
    if (auto done = Checker{}.check(document); !done) return tl::unexpected(done.error());
    return document;
  } catch (const Json::exception& error) {
    return invalid_input("its JSON cannot be read: " + parser_text(error.what()));
  }
}

build::Result<std::span<const unsigned char>> gltf_binary_chunk(std::span<const std::byte> file) {
  constexpr std::uint32_t kBinary = 0x004e4942;  // "BIN" and a zero byte.
  const std::string_view text{reinterpret_cast<const char*>(file.data()), file.size()};
  std::span<const unsigned char> chunks{reinterpret_cast<const unsigned char*>(file.data()), file.size()};
  if (!text.starts_with("glTF")) return std::span<const unsigned char>{};
  for (chunks = chunks.subspan(kGlbHeader); chunks.size() >= kChunkHeader;) {
    std::array<std::uint32_t, 2> header{};  // Length and type.
    std::memcpy(header.data(), chunks.data(), sizeof(header));
    chunks = chunks.subspan(kChunkHeader);
    if (header[0] > chunks.size())
      return invalid_input("truncated: the binary chunk has " + std::to_string(header[0]) + " bytes, but only " +
                           std::to_string(chunks.size()) + " are left");
    if (header[1] == kBinary) return chunks.first(header[0]);
    chunks = chunks.subspan(header[0]);
  }
  return std::span<const unsigned char>{};
}

}  // namespace hiprt::tools
