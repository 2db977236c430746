/// Readers take memory only for what a file of its size can have. Every number of small valid files is replaced by
/// large ones. They get 128 MiB of address space beyond the program's own.

#include <tests/fuzz/part_of_scene.h>
#include <tests/tools/limited_child.h>
#include <tests/tools/load.h>
#include <tests/tools/picture_files.h>
#include <tests/tools/scene_file.h>
#include <tests/tools/zstd_bytes.h>
#include "compressed_gltf.h"
#include "hair_files.h"

#include <tools/base/memory_limit.h>
#include <tools/cli/bvh_file.h>
#include <tools/parts/part_manifest.h>
#include <tools/render/image/image.h>
#include <tools/render/image/image_read.h>
#include <tools/render/image/image_write.h>
#include <tools/scene_io/exchange_json.h>
#include <tools/scene_io/npy_file.h>
#include <tools/scene_io/query_file.h>
#include <tools/scene_io/rays_file.h>
#include <tools/scene_io/scene/scene_description.h>
#include <tools/scene_io/scene/scene_file.h>
#include <tools/scene_io/shapes/shape_import.h>
#include <tools/scene_io/surface/picture.h>

#include <zlib.h>

#include <array>
#include <bit>
#include <cctype>
#include <functional>
#include <optional>

using namespace hiprt;
using namespace hiprt::test;

namespace {

constexpr std::size_t kAddressSpace = std::size_t{128} << 20;
constexpr std::array<std::uint64_t, 4> kCounts{1u << 16, 1u << 31, 0xffffffffu, std::uint64_t{1} << 63};

/// Reads a file. @return the error, or nothing.
using Reader = std::function<std::optional<build::Error>(const std::filesystem::path&)>;

template <class Value> std::optional<build::Error> error_of(const build::Result<Value>& result) {
  return result ? std::nullopt : std::optional<build::Error>(result.error());
}

/// The file with a number in place of the bytes at each offset, in both byte orders, and with 8 bytes for 2^63.
std::vector<std::string> with_binary_numbers(const std::string& file) {
  std::vector<std::string> result;
  for (std::size_t at = 0; at < file.size(); ++at)
    for (const std::uint64_t count : kCounts) {
      std::string little;
      append(little, count);
      if (count <= 0xffffffffu) little.resize(4);
      if (at + little.size() > file.size()) continue;
      result.push_back(std::string(file).replace(at, little.size(), little));
      result.push_back(std::string(file).replace(at, little.size(), std::string(little.rbegin(), little.rend())));
    }
  return result;
}

/// The file with a number in place of each of its numbers.
std::vector<std::string> with_text_numbers(const std::string& file) {
  std::vector<std::string> result;
  const auto is_digit = [&](std::size_t i) { return std::isdigit(static_cast<unsigned char>(file[i])) != 0; };
  for (std::size_t at = 0; at < file.size();) {
    std::size_t end = at;
    while (end < file.size() && is_digit(end)) ++end;
    for (const std::uint64_t count : kCounts)
      if (end > at) result.push_back(std::string(file).replace(at, end - at, std::to_string(count)));
    at = std::max(at + 1, end);
  }
  return result;
}

/// @return what went wrong with memory; the number in the file has to be the reason of an error.
std::string memory_fault(const Reader& read, const std::filesystem::path& path) {
  try {
    const auto error = read(path);
    return error && error->code == build::ErrorCode::kOutOfMemory ? error->message : std::string();
  } catch (const std::exception& error) {
    return std::string("exception ") + error.what();
  }
}

/// Reads all files in a child.
void check_bounded(const std::string& name, const std::vector<std::string>& files, const Reader& read) {
  INFO(name);
  REQUIRE(files.size() >= 8);
  const TempFolder folder;
  const std::string result = in_limited_child(kAddressSpace, [&] {
    for (std::size_t i = 0; i < files.size(); ++i)
      if (const std::string fault = memory_fault(read, folder.write(name, files[i])); !fault.empty())
        return "input " + std::to_string(i) + ": " + fault;
    return "all " + std::to_string(files.size()) + " read";
  });
  CHECK(result == "all " + std::to_string(files.size()) + " read");
}

std::optional<build::Error> read_mesh(const std::filesystem::path& path) { return error_of(tools::load_mesh(path)); }

std::optional<build::Error> read_assembly(const std::filesystem::path& path) {
  return error_of(tools::load_assembly(path, {0.0f, 1.0f}));
}

/// A file of a triangle with a sparse accessor, an animation and instances.
GltfBuilder gltf() {
  GltfBuilder b;
  const int positions = b.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const int indices = b.add_accessor<std::uint16_t>({0, 1, 2}, 5123, "SCALAR", 3);
  b.json["accessors"][static_cast<std::size_t>(positions)]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", b.add_view<std::uint16_t>({1})}, {"componentType", 5123}}},
      {"values", {{"bufferView", b.add_view<float>({2, 0, 0})}}}};
  b.add_mesh(positions, indices);
  b.json["accessors"].push_back({{"componentType", 5126}, {"type", "VEC3"}, {"count", 3}});
  b.add_mesh(static_cast<int>(b.json["accessors"].size()) - 1);
  const int times = b.add_accessor<float>({0, 1}, 5126, "SCALAR", 2);
  const int moves = b.add_accessor<float>({0, 0, 0, 1, 0, 0}, 5126, "VEC3", 2);
  b.json["animations"] = {{{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
                           {"samplers", {{{"input", times}, {"output", moves}}}}}};
  b.json["nodes"] = {
      {{"mesh", 0}},
      {{"mesh", 1}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", moves}}}}}}}}};
  b.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  b.json["scenes"] = {{{"nodes", {0, 1}}}};
  return b;
}

}  // namespace

TEST_CASE("Reader memory: text formats of meshes") {
  check_bounded("a.obj", with_text_numbers("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf -1 -2 -3\nl 1 2\n"),
                read_mesh);
  check_bounded("a.stl",
                with_text_numbers("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                                  "endloop\nendfacet\nendsolid a\n"),
                read_mesh);
  const std::string header =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uint uint vertex_indices\nelement edge 1\nproperty list int int a\nend_header\n";
  check_bounded("a.ply",
                with_text_numbers("ply\nformat ascii 1.0\n" + header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n2 5 6\n"),
                read_mesh);
  check_bounded("a.xyzr", with_text_numbers("0 0 0 1\n1 2 3 4\n"),
                [](const auto& path) { return error_of(tools::load_shapes(path)); });
}

TEST_CASE("Reader memory: binary formats of meshes and shapes") {
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uint uint vertex_indices\nelement edge 1\nproperty list int int a\nend_header\n";
  auto files = with_text_numbers(ply);
  append(ply, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 3u, 0u, 1u, 2u, 1u, 7u);
  for (std::string& file : files) file += ply.substr(ply.find("end_header\n") + 11);
  const auto more = with_binary_numbers(ply);
  files.insert(files.end(), more.begin(), more.end());
  check_bounded("a.ply", files, read_mesh);
  std::string stl(80, ' ');
  append(stl, 1u, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, std::uint16_t{0});
  check_bounded("a.stl", with_binary_numbers(stl), read_mesh);
  std::string raw;
  append(raw, 3u, 1u, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0u, 1u, 2u);
  files = with_binary_numbers(raw);
  check_bounded("a.mesh", files, read_mesh);
  for (std::string& file : files) file = zstd(file);
  check_bounded("a.mesh.zst", files, read_mesh);
  check_bounded("b.mesh.zst", with_binary_numbers(zstd(raw)), read_mesh);
  const auto load_shapes = [](const auto& path) { return error_of(tools::load_shapes(path)); };
  check_bounded("a.hair", with_binary_numbers(HairFile().bytes()), load_shapes);
  HairFile hair;
  hair.arrays = 2;
  hair.points = hair.strands = 5;
  check_bounded("b.hair", with_binary_numbers(hair.bytes()), load_shapes);
}

TEST_CASE("Reader memory: glTF, JSON and binary") {
  const GltfBuilder b = gltf();
  check_bounded("a.gltf", with_text_numbers(b.embedded()), read_mesh);
  check_bounded("a.gltf", with_text_numbers(b.embedded()), read_assembly);
  check_bounded("a.glb", with_binary_numbers(b.glb()), read_assembly);
}

TEST_CASE("Reader memory: compressed glTF") {
  std::vector<std::string> files;
  for (const std::string& data : {kEdgebreaker, kSequential})
    for (const std::string& changed : with_binary_numbers(data)) files.push_back(draco_file(changed).embedded());
  check_bounded("draco.gltf", files, read_mesh);
  files.clear();
  for (const std::string& changed : with_binary_numbers(kMeshoptVertices))
    files.push_back(with_fallback(meshopt_file(changed, "NONE", kMeshoptTriangles, "TRIANGLES")));
  for (const std::string& changed : with_binary_numbers(kMeshoptTriangles))
    files.push_back(with_fallback(meshopt_file(kMeshoptVertices, "NONE", changed, "TRIANGLES")));
  check_bounded("meshopt.gltf", files, read_mesh);
  check_bounded("meshopt.gltf",
                with_text_numbers(with_fallback(meshopt_file(kMeshoptVertices, "NONE", kMeshoptSequence, "INDICES"))),
                read_mesh);
}

TEST_CASE("Reader memory: scenes, trees, rays, hits and paths") {
  const auto read_scene = [](const auto& path) { return error_of(tools::read_scene_file(path)); };
  check_bounded("a.scene", with_binary_numbers(SceneFile().triangle(0).group({{0, 1.f}, {0, 2.f}}).bytes()),
                read_scene);
  check_bounded("a.json", with_text_numbers(R"({"format": "hiprt scene", "version": 1, "scene": "top",
 "objects": {"ball": {"spheres": [[0, 0, 0, 1]]}, "hair": {"curves": [[[0, 0, 0, 1], [1, 0, 0, 1]]]}},
 "groups": {"top": [{"object": "ball", "mask": 3, "id": 7}, {"object": "hair", "translate": [4, 0, 1]}]}})"),
                read_scene);
  check_bounded("tree.json", with_text_numbers(R"({"format": "hiprt exchange bvh", "version": 1,
 "nodes": [{"min": [0, 0, 0], "max": [2, 1, 0], "children": [1, 2]},
           {"min": [0, 0, 0], "max": [1, 1, 0], "primitives": [0, 1]},
           {"min": [1, 0, 0], "max": [2, 1, 0], "primitives": [1, 3]}], "primitives": [2, 0, 3, 1]})"),
                [](const auto& path) { return error_of(tools::read_exchange(path)); });
  std::string numbers;
  append(numbers, 1u, 0u, 0.f, 0.f, 0.f, 0.f, 0.f, 0.f, 1.f, 9.f);
  check_bounded("a.rays", with_binary_numbers(numbers),
                [](const auto& path) { return error_of(tools::read_rays(path)); });
  check_bounded("a.hits", with_binary_numbers(numbers),
                [](const auto& path) { return error_of(tools::read_hits(path)); });
  check_bounded("a.paths", with_binary_numbers(numbers),
                [](const auto& path) { return error_of(tools::read_paths(path)); });
}

TEST_CASE("Reader memory: queries, arrays of numpy, BVH files, parts") {
  const auto read_points = [](const auto& path) {
    return error_of(tools::read_queries(path, tools::QueryShape::kPoint));
  };
  std::string points;
  append(points, 1u, 3u, 0.f, 1.f, 2.f);
  check_bounded("a.queries", with_binary_numbers(points), read_points);
  std::vector<std::string> arrays;
  for (const std::uint64_t count : kCounts)
    for (const std::array<std::uint64_t, 2> shape : {std::array{count, std::uint64_t{3}}, {std::uint64_t{1}, count}})
      arrays.push_back(tools::npy_header("'<f4'", shape) + points.substr(8));
  check_bounded("a.npy", arrays, read_points);

  const build::Buffer bvh = fuzz::part_bvh();
  const auto text_of = [](std::span<const std::byte> bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  check_bounded("a.bvh", with_binary_numbers(text_of(bvh.bytes().first(sizeof(FileHeader)))),
                [](const auto& path) { return error_of(tools::open_bvh(path, std::uint64_t{1} << 40, 1)); });
  check_bounded("a.data", with_binary_numbers(text_of(tools::encode(fuzz::part_data()))), [&](const auto& path) {
    const std::string bytes = read_file(path);
    return error_of(tools::decode_part_data(std::as_bytes(std::span(bytes)), *open_buffer(bvh.bytes())));
  });
  const tools::ScenePart part = fuzz::described_part();
  check_bounded("parts.json", with_text_numbers(tools::to_json({"", 2, 4, true, {part, part}, part})),
                [](const auto& path) { return error_of(tools::parse_part_manifest(read_file(path), path.string())); });
}

TEST_CASE("Reader memory: pictures") {
  const auto decode = [](const auto& path) {
    const std::string bytes = read_file(path);
    return error_of(tools::decode_picture(std::as_bytes(std::span(bytes)), std::uint64_t{1} << 28));
  };
  const std::vector<unsigned char> texels(4 * 8 * 8, 77);
  check_bounded("a.png", with_binary_numbers(png_file(8, 8, texels)), decode);
  // libpng checks the sum of the header's chunk; here it is right.
  const std::string wide = png_file(16384, 1, std::vector<unsigned char>(4 * 16384, 77));
  std::vector<std::string> headers;
  for (const std::uint32_t height : {0x1000u, 0x2000u, 0x3000u, 0x4000u, 0x10000u, 0x7fffffffu, 0x80000000u, ~0u}) {
    std::string file = wide, bytes;
    append(bytes, height);
    file.replace(20, 4, std::string(bytes.rbegin(), bytes.rend()));
    std::string sum;
    append(sum, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const unsigned char*>(&file[12]), 17)));
    headers.push_back(file.replace(29, 4, std::string(sum.rbegin(), sum.rend())));
  }
  check_bounded("b.png", headers, decode);
  check_bounded("a.jpg", with_binary_numbers(jpeg_file(8, 8, std::vector<unsigned char>(3 * 8 * 8, 77))), decode);
}

TEST_CASE("Reader memory: OpenEXR") {
  const TempFolder folder;
  tools::Image image(4, 4);
  REQUIRE(tools::write_exr(folder / "a.exr", image, {}));
  check_bounded("a.exr", with_binary_numbers(read_file(folder / "a.exr")),
                [](const auto& path) { return error_of(tools::read_exr_colors(path)); });
}

TEST_CASE("Memory limit: readers stop at it with an error that names the option; it ends with its object") {
  if (!kCanLimitMemory) return;
  const TempFolder folder;
  std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (unsigned i = 0; i < 2'000'000; ++i) obj += "f 1 2 3\n";
  const std::string path = folder.write("a.obj", obj);
  {
    const tools::MemoryLimit limit(8 << 20);
    const auto mesh = tools::load_mesh(path);
    REQUIRE_FALSE(mesh);
    CHECK(mesh.error().code == build::ErrorCode::kOutOfMemory);
    CHECK(mesh.error().message ==
          path + ": not enough memory to read it; the limit is 8388608 bytes, --max-memory sets it");
  }
  CHECK(load(path).triangles.size() == 2'000'000);
  const tools::MemoryLimit half_of_the_machine(0);
  CHECK(load(path).triangles.size() == 2'000'000);
}
