#pragma once
/// Small compressed glTF files for tests: the square (0, 0) to (1, 1) of two triangles.

#include "gltf_builder.h"

#include <string>
#include <string_view>
#include <vector>

namespace hiprt::test {

inline std::string from_base64(const std::string& text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned word = 0, bits = 0;
  for (const char c : text.substr(0, text.find('='))) {
    word = word << 6 | static_cast<unsigned>(kDigits.find(c));
    if (bits += 6; bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(word >> bits & 0xffu);
  }
  return bytes;
}

/// By Draco 1.5.5's encoder: edgebreaker with 8 bits per coordinate, and sequential.
inline const std::string kEdgebreaker =
    from_base64("RFJBQ08CAgEBAAAABAIAAgAAAR//AREB/wAAAQAJAwAAAgEBAQADAwEwARADACiCmAAAAAAA/wAAAAAAAAAAAAAAAAAAAAAAgD8I");
inline const std::string kSequential = from_base64(
    "RFJBQ08CAgEAAAACBAEAAQIAAgMBAQAJAwAAAAAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAIA/AAAAAAAAAAAAAIA/AAAAAA==");
/// Its vertices and indices by meshoptimizer 0.18: vertices, the same through the exponential filter, triangles,
/// sequence.
inline const std::string kMeshoptVertices =
    from_base64("oAAAATMAAAD//wEzAAAAfn0AAAEMAAAA/wEMAAAAfgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==");
inline const std::string kMeshoptExponential =
    from_base64("oAABMwAAAEA/AAEgAAAAAAEMAAAAQAABIAAAAAAAAAEgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADyAAAA8gAAAPI=");
inline const std::string kMeshoptTriangles = from_base64("4fAAAHaHVmd4qYZliWiYAWkAAA=="),
                         kMeshoptSequence = from_base64("0QAEBAYIBAAAAAA=");

inline int add_bytes(GltfBuilder& b, const std::string& bytes) {
  return b.add_view(std::vector<char>(bytes.begin(), bytes.end()));
}

inline GltfBuilder draco_file(const std::string& data) {
  GltfBuilder b;
  const int view = add_bytes(b, data);
  // As encoders write: no bufferView, or -1 for none.
  b.json["accessors"] = {{{"bufferView", -1}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 4}},
                         {{"componentType", 5123}, {"type", "SCALAR"}, {"count", 6}}};
  b.add_mesh(0, 1);
  b.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", view}, {"attributes", {{"POSITION", 0}}}};
  b.json["nodes"] = {{{"mesh", 0}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  b.json["extensionsUsed"] = b.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return b;
}

inline GltfBuilder meshopt_file(const std::string& vertices, const std::string& filter, const std::string& indices,
                                const std::string& mode) {
  GltfBuilder b;
  const auto add = [&](const std::string& data, std::size_t count, std::size_t stride, const std::string& as,
                       const std::string& through) {
    const int from = add_bytes(b, data);
    const nlohmann::json place = b.json["bufferViews"][static_cast<std::size_t>(from)];
    // The fallback buffer, number 1, is not there.
    b.json["bufferViews"].push_back({{"buffer", 1},
                                     {"byteLength", count * stride},
                                     {"extensions",
                                      {{"EXT_meshopt_compression",
                                        {{"buffer", 0},
                                         {"byteOffset", place["byteOffset"]},
                                         {"byteLength", place["byteLength"]},
                                         {"count", count},
                                         {"byteStride", stride},
                                         {"mode", as},
                                         {"filter", through}}}}}});
    return b.json["bufferViews"].size() - 1;
  };
  const auto positions = add(vertices, 4, 12, "ATTRIBUTES", filter), corners = add(indices, 6, 4, mode, "NONE");
  b.json["accessors"] = {{{"bufferView", positions}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 4}},
                         {{"bufferView", corners}, {"componentType", 5125}, {"type", "SCALAR"}, {"count", 6}}};
  b.add_mesh(0, 1);
  b.json["nodes"] = {{{"mesh", 0}}};
  b.json["scenes"] = {{{"nodes", {0}}}};
  b.json["extensionsUsed"] = b.json["extensionsRequired"] = {"EXT_meshopt_compression"};
  return b;
}

/// The file with a second buffer that a decoder would fill.
inline std::string with_fallback(const GltfBuilder& b) {
  nlohmann::json document = nlohmann::json::parse(b.embedded());
  document["buffers"].push_back(
      {{"byteLength", 1000}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
  return document.dump();
}

}  // namespace hiprt::test
