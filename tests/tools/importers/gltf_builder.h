#pragma once
/// Small glTF files for tests: a JSON document and one buffer.

#include <tests/tools/temp_folder.h>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace hiprt::test {

inline std::string base64(const std::string& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63u] : '=';
  }
  return text;
}

class GltfBuilder {
 public:
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};
  std::string buffer;

  /// Appends values as a bufferView. @return its number.
  template <class T> int add_view(const std::vector<T>& values, int stride = 0) {
    buffer.resize((buffer.size() + 3) / 4 * 4);
    nlohmann::json view = {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", values.size() * sizeof(T)}};
    if (stride != 0) view["byteStride"] = stride;
    for (const T& value : values) append(buffer, value);
    json["bufferViews"].push_back(view);
    return static_cast<int>(json["bufferViews"].size()) - 1;
  }

  /// @return the number of an accessor over a new bufferView of @p values.
  template <class T>
  int add_accessor(const std::vector<T>& values, int component_type, const std::string& type, std::size_t count) {
    const int view = add_view(values);
    json["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component_type}, {"type", type}, {"count", count}});
    return static_cast<int>(json["accessors"].size()) - 1;
  }

  int add_positions(const std::vector<float>& values) { return add_accessor(values, 5126, "VEC3", values.size() / 3); }

  /// A mesh of one primitive; @p indices -1: none. @return its number.
  int add_mesh(int positions, int indices = -1, int mode = 4) {
    nlohmann::json primitive = {{"attributes", {{"POSITION", positions}}}, {"mode", mode}};
    if (indices >= 0) primitive["indices"] = indices;
    json["meshes"].push_back({{"primitives", {primitive}}});
    return static_cast<int>(json["meshes"].size()) - 1;
  }

  /// Adds an animation of one channel of a node. @param path "translation", "rotation", "scale" or "weights".
  void animate(int node, const std::string& path, const std::vector<float>& times, const std::vector<float>& values,
               const std::string& interpolation = "LINEAR") {
    const std::size_t components = path == "weights" ? 1 : path == "rotation" ? 4 : 3;
    const std::string type = components == 1 ? "SCALAR" : "VEC" + std::to_string(components);
    const int input = add_accessor(times, 5126, "SCALAR", times.size());
    const int output = add_accessor(values, 5126, type, values.size() / components);
    json["animations"].push_back(
        {{"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}},
         {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}}});
  }

  /// The document with the buffer inside, in base64.
  std::string embedded() const {
    nlohmann::json document = json;
    document["buffers"] = {
        {{"byteLength", buffer.size()}, {"uri", "data:application/octet-stream;base64," + base64(buffer)}}};
    return document.dump();
  }

  std::string with_external_buffer(const std::string& uri) const {
    nlohmann::json document = json;
    document["buffers"] = {{{"byteLength", buffer.size()}, {"uri", uri}}};
    return document.dump();
  }

  std::string glb() const {
    nlohmann::json document = json;
    document["buffers"] = {{{"byteLength", buffer.size()}}};
    std::string text = document.dump(), binary = buffer, file = "glTF";
    text.resize((text.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    append(file, 2u, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
    append(file, static_cast<std::uint32_t>(text.size()), 0x4e4f534au);
    file += text;
    append(file, static_cast<std::uint32_t>(binary.size()), 0x004e4942u);
    return file + binary;
  }
};

}  // namespace hiprt::test
