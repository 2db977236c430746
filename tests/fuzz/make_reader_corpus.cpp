/// Seeds of fuzz_readers: a folder per reader, a few small files in each.

#include "make_reader_corpus.h"
#include "part_of_scene.h"

#include <tests/tools/importers/compressed_gltf.h>
#include <tests/tools/importers/hair_files.h>
#include "../tools/picture_files.h"
#include "../tools/scene_file.h"
#include "../tools/zstd_bytes.h"

#include <tools/parts/part_manifest.h>
#include <tools/scene_io/npy_file.h>

#include <ImfRgbaFile.h>

#include <array>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace hiprt::fuzz {
namespace {

using namespace hiprt::test;

constexpr const char* kObj =
    "# a comment\nv 0 0 0\nv 1 0 0 1 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nmtllib a.mtl\nusemtl a\ng b\n"
    "f 1/1/1 2/1 3//1 \\\n 4\nf -1 -2 -3\nl 1 2\np 1\n";
constexpr const char* kPlyHeader =
    "comment a\nobj_info b\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\nproperty uchar "
    "red\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
constexpr const char* kPlyStrips =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement tristrips "
    "1\n"
    "property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 -1 1 2 3 -1\n";
constexpr const char* kStl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid "
    "a\n";
constexpr const char* kScene =
    R"({"format": "hiprt scene", "version": 1, "scene": "g", "objects": {"a": ["a.obj", {"shape": "x.hair"}]},
"groups": {"h": [{"object": "a"},
{"object": "a", "translate": [4, 0, 1], "rotate": {"axis": [0, 1, 0], "degrees": 75}}],
"g": [{"object": "h", "scale": 1.5, "mask": 3, "id": 7},
{"object": "h", "matrix": [1, 0, 0, 30, 0, 1, 0, 0, 0, 0, 1, 8]},
{"object": "a", "motion": {"times": [0, 1], "keys": [{"translate": [1, 0, 0]}, {"rotate": [0, 0, 0.6, 0.8]}]}}]}})";
constexpr const char* kTree =
    R"({"format": "hiprt exchange bvh", "version": 1,
"nodes": [{"min": [0, 0, 0], "max": [2, 1, 0], "children": [1, 2]},
{"min": [0, 0, 0], "max": [1, 1, 0], "primitives": [0, 1]}, {"min": [1, 0, 0], "max": [2, 1, 0], "primitives": [1, 3]}],
"primitives": [2, 0, 3, 1]})";

/// Values in the order of the machine's bytes, or in the other one.
template <class Value> void put(std::string& file, Value value, bool swapped) {
  std::string bytes;
  append(bytes, value);
  file += swapped ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

std::string binary_ply(bool big) {
  std::string file = std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" + kPlyHeader;
  for (unsigned i = 0; i < 4; ++i) {
    put(file, static_cast<float>(i % 2), big);
    put(file, i < 2 ? 0.0 : 1.0, big);
    put(file, 0.0f, big);
    file += '\x7f';
  }
  for (const int first : {0, 1}) {
    file += '\x03';
    for (int i = 0; i < 3; ++i) put(file, first + i, big);
  }
  return file;
}

std::string binary_stl() {
  std::string file(80, ' ');
  append(file, 1u);
  for (const float x : {0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) append(file, x);
  return file + std::string(2, '\0');
}

std::string raw_mesh() {
  std::string file;
  append(file, 3u, 1u, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0u, 1u, 2u);
  return file;
}

/// An animated triangle with a material, a texture and a skin of one joint; morph targets; instances.
GltfBuilder gltf() {
  GltfBuilder b;
  const int positions = b.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int indices = b.add_accessor<std::uint16_t>({0, 1, 2}, 5123, "SCALAR", 3);
  const int coordinates = b.add_accessor<float>({0, 0, 1, 0, 0, 1}, 5126, "VEC2", 3);
  const int joints = b.add_accessor<std::uint8_t>(std::vector<std::uint8_t>(12, 0), 5121, "VEC4", 3);
  const int weights = b.add_accessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, 5126, "VEC4", 3);
  const int times = b.add_accessor<float>({0, 1}, 5126, "SCALAR", 2);
  const int moves = b.add_accessor<float>({0, 0, 0, 1, 0, 0}, 5126, "VEC3", 2);
  b.json["accessors"][static_cast<std::size_t>(positions)]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", b.add_view<std::uint16_t>({1})}, {"componentType", 5123}}},
      {"values", {{"bufferView", b.add_view<float>({2, 0, 0})}}}};
  b.add_mesh(positions, indices);
  auto& primitive = b.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_0"] = coordinates;
  primitive["attributes"]["JOINTS_0"] = joints;
  primitive["attributes"]["WEIGHTS_0"] = weights;
  primitive["targets"] = {{{"POSITION", positions}}};
  primitive["material"] = 0;
  b.json["meshes"][0]["weights"] = {0.5};
  b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}, {"alphaMode", "MASK"}}};
  b.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  b.json["samplers"] = {{{"wrapS", 33071}}};
  b.json["images"] = {{{"bufferView", add_bytes(b, png_file(1, 1, {1, 2, 3, 4}))}, {"mimeType", "image/png"}}};
  b.json["skins"] = {{{"joints", {1}}}};
  b.json["animations"] = {{{"channels", {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "translation"}}}}}},
                           {"samplers", {{{"input", times}, {"output", moves}, {"interpolation", "LINEAR"}}}}}};
  b.json["nodes"] = {
      {{"mesh", 0}, {"skin", 0}},
      {{"mesh", 0}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", moves}}}}}}}}};
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  b.json["scenes"] = {{{"nodes", {0, 1}}}};
  return b;
}

std::vector<std::string> pictures() {
  std::vector<std::string> files{png_file(2, 2, std::vector<unsigned char>(16, 99)),
                                 jpeg_file(9, 9, std::vector<unsigned char>(243, 80))};
  files.push_back(png_file(PngContent{.width = 4,
                                      .height = 2,
                                      .color_type = PNG_COLOR_TYPE_PALETTE,
                                      .depth = 2,
                                      .rows = {0x1b, 0x1b},
                                      .palette = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}},
                                      .transparent = {0, 128}}));
  files.push_back(png_file(PngContent{.width = 3,
                                      .height = 3,
                                      .color_type = PNG_COLOR_TYPE_GRAY,
                                      .depth = 16,
                                      .rows = std::vector<unsigned char>(18, 7),
                                      .interlaced = true}));
  return files;
}

std::string exr(const std::filesystem::path& folder, Imf::Compression compression) {
  const std::filesystem::path path = folder / "seed.exr";
  const std::array<Imf::Rgba, 12> pixels{};
  {
    Imf::RgbaOutputFile file(path.c_str(), 4, 3, Imf::WRITE_RGB, 1, {0, 0}, 1, Imf::INCREASING_Y, compression);
    file.setFrameBuffer(pixels.data(), 1, 4);
    file.writePixels(3);
  }
  std::ifstream in(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  std::filesystem::remove(path);
  return bytes;
}

void write(const std::filesystem::path& folder, const std::vector<std::string>& seeds) {
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    std::ofstream file(folder / ("seed-" + std::to_string(i)), std::ios::binary);
    file << seeds[i];
    if (!file.flush()) throw std::runtime_error("cannot write into " + folder.string());
  }
}

std::string floats(std::uint32_t count, std::uint32_t second, const std::vector<float>& values) {
  std::string file;
  append(file, count, second);
  for (const float x : values) append(file, x);
  return file;
}

void write_compressed(const std::filesystem::path& folder) {
  const GltfBuilder edgebreaker = draco_file(kEdgebreaker), sequential = draco_file(kSequential);
  const GltfBuilder meshopt = meshopt_file(kMeshoptVertices, "NONE", kMeshoptTriangles, "TRIANGLES");
  const GltfBuilder filtered = meshopt_file(kMeshoptExponential, "EXPONENTIAL", kMeshoptSequence, "INDICES");
  write(folder / "gltf", {gltf().embedded(), edgebreaker.embedded(), meshopt.embedded()});
  write(folder / "glb", {gltf().glb(), edgebreaker.glb(), sequential.glb(), meshopt.glb(), filtered.glb()});
}

}  // namespace

void make_reader_corpus(const std::filesystem::path& folder) {
  const std::string header = kPlyHeader;
  write(folder / "obj", {kObj});
  write(folder / "ply", {"ply\nformat ascii 1.0\n" + header + "0 0 0 1\n1 0 0 1\n0 1 0 1\n1 1 0 1\n3 0 1 2\n3 1 2 3\n",
                         kPlyStrips, binary_ply(false), binary_ply(true)});
  write(folder / "stl", {kStl, binary_stl()});
  write(folder / "mesh", {raw_mesh()});
  write(folder / "zst", {zstd(raw_mesh())});
  write_compressed(folder);
  write(folder / "hair", {HairFile().bytes(), HairFile{.arrays = 2, .default_segments = 4}.bytes()});
  write(folder / "xyzr", {"0 0 0 1\n# a\n\n1 2 3 4e-1 # b\n"});
  write(folder / "scene", {test::SceneFile().triangle(0).group({{0, 1.0f}, {0, 2.0f}}).group({{1, 0.5f}}).bytes()});
  write(folder / "json", {kScene});
  write(folder / "tree", {kTree});
  write(folder / "picture", pictures());
  std::filesystem::create_directories(folder / "exr");
  write(folder / "exr", {exr(folder / "exr", Imf::NO_COMPRESSION), exr(folder / "exr", Imf::ZIP_COMPRESSION),
                         exr(folder / "exr", Imf::PIZ_COMPRESSION), exr(folder / "exr", Imf::B44_COMPRESSION)});
  write(folder / "rays", {floats(1, 0, {0, 0, 0, 0, 0, 0, 1, 9})});
  write(folder / "hits", {floats(0x3f800000u, 7, {})});
  write(folder / "paths", {floats(1, 1, {0, 0})});
  const std::array<std::uint64_t, 2> points{1, 3};
  write(folder / "queries", {floats(1, 3, {0, 0, 0}), floats(1, 4, {0, 0, 0, 1}), floats(1, 6, {0, 0, 0, 1, 1, 1}),
                             tools::npy_header("'<f4'", points) + std::string(12, '\0'),
                             tools::npy_header("[('x', '>f8', (3,))]", points) + std::string(72, '\0')});
  const tools::ScenePart part = described_part();
  write(folder / "parts",
        {tools::to_json({"", 2, 4, true, {part, part}, part}), tools::to_json({"", 1, 2, false, {part}, {}})});
  const std::vector<std::byte> data = tools::encode(part_data()), clay = tools::encode({{{}, {}}, {}});
  const auto text = [](const std::vector<std::byte>& bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  write(folder / "part-data", {text(data), text(clay)});
}

}  // namespace hiprt::fuzz
