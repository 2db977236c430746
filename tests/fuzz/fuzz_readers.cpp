/// libFuzzer target: a reader refuses a file with an error, or accepts it. `--reader=NAME` chooses one; inputs are
/// plain files of its format. Errors, memory (-malloc_limit_mb) and time (-timeout) are libFuzzer's and the sanitizers'
/// to see.

#include "part_of_scene.h"

#include <tools/base/read_input.h>
#include <tools/parts/part_manifest.h>
#include <tools/render/image/image_read.h>
#include <tools/scene_io/exchange_json.h>
#include <tools/scene_io/mesh/mesh_import.h>
#include <tools/scene_io/query_file.h>
#include <tools/scene_io/rays_file.h>
#include <tools/scene_io/scene/scene_description.h>
#include <tools/scene_io/scene/scene_file.h>
#include <tools/scene_io/scene/surface_load.h>
#include <tools/scene_io/shapes/shape_import.h>
#include <tools/scene_io/surface/material_library.h>
#include <tools/scene_io/surface/picture.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <unistd.h>

using namespace hiprt;

namespace {

using Path = std::filesystem::path;

/// Like assert, but there in release builds too.
void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "fuzz_readers: %s\n", what);
  std::abort();
}

void check_error(const build::Error& error) {
  require(!error.message.empty(), "an error without a message");
  require(error.code != build::ErrorCode::kOutOfMemory, "a small file that needs more memory than there is");
}

template <class Value> bool accepted(const build::Result<Value>& result) {
  if (!result) check_error(result.error());
  return result.has_value();
}

void check_mesh(const tools::Mesh& mesh) {
  require(mesh.positions.size() % mesh.keys == 0, "a key without all positions");
  const std::size_t vertices = mesh.positions.size() / mesh.keys;
  for (const build::Triangle& triangle : mesh.triangles)
    for (const std::uint32_t index : triangle) require(index < vertices, "an index behind the positions");
  if (mesh.keys > 1)
    for (const build::Position& p : mesh.positions)
      require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]), "a position that is not finite");
}

void read_mesh(const Path& path) {
  if (const auto mesh = tools::load_mesh(path); accepted(mesh)) check_mesh(*mesh);
}

/// As bvhbuild and as the path tracer read it.
void read_gltf(const Path& path) {
  tools::MaterialLibrary library;
  if (const auto mesh = tools::load_mesh(path, &library); accepted(mesh)) check_mesh(*mesh);
  const auto assembly = tools::load_assembly(path, {0.0f, 0.5f, 1.0f});
  if (!accepted(assembly)) return;
  for (const tools::Mesh& mesh : assembly->meshes) check_mesh(mesh);
  for (const tools::MeshUse& use : assembly->uses)
    require(use.mesh < assembly->meshes.size(), "a use of a mesh that is not there");
}

void read_shapes(const Path& path) {
  const auto shapes = tools::load_shapes(path);
  if (!accepted(shapes)) return;
  for (const ShapePoint& point : shapes->points)
    require(tools::shape_point_fault(point).empty(), "an invalid point was accepted");
  for (const std::uint32_t first : shapes->segments)
    require(first + std::uint64_t{1} < shapes->points.size(), "a segment behind the points");
}

void read_scene(const Path& path) {
  const auto scene = tools::read_scene_file(path.string());
  if (!accepted(scene)) return;
  for (std::size_t group = 0; group < scene->groups.size(); ++group)
    for (const build::Instance& instance : scene->groups[group].instances)
      require(instance.object < scene->objects.size() + group, "an instance of a later group");
  for (const tools::Mesh& mesh : scene->meshes) check_mesh(mesh);
}

void read_tree(const Path& path) { accepted(tools::read_exchange(path)); }
void read_rays(const Path& path) { accepted(tools::read_rays(path)); }
void read_queries(const Path& path) {
  for (const auto shape : {tools::QueryShape::kPoint, tools::QueryShape::kSphere, tools::QueryShape::kBox})
    accepted(tools::read_queries(path, shape));
}
void read_hits(const Path& path) { accepted(tools::read_hits(path)); }
void read_paths(const Path& path) { accepted(tools::read_paths(path)); }
void read_exr(const Path& path) { accepted(tools::read_exr_colors(path)); }

void read_manifest(const Path& path) {
  const auto bytes = tools::read_input(path);
  if (!accepted(bytes)) return;
  const std::string_view text(reinterpret_cast<const char*>(bytes->bytes().data()), bytes->size());
  const auto manifest = tools::parse_part_manifest(text, path.string());
  if (!accepted(manifest)) return;
  require(tools::parse_part_manifest(tools::to_json(*manifest), path.string()).has_value(),
          "a manifest that cannot be written and read again");
}

void read_part_data(const Path& path) {
  static const build::Buffer bvh = fuzz::part_bvh();
  const auto bytes = tools::read_input(path);
  if (!accepted(bytes)) return;
  const auto data = tools::decode_part_data(bytes->bytes(), *open_buffer(bvh.bytes()));
  if (!accepted(data) || !data->surfaces) return;
  for (const auto& object : data->surfaces->objects)
    for (const tools::GeometrySurface& geometry : object)
      for (const std::uint32_t material : geometry.materials)
        require(material < data->surfaces->materials.size(), "a material that is not there");
}

/// The limit of texels is small, so that a large picture is no slow input.
void read_picture(std::span<const std::byte> bytes) {
  const auto texture = tools::decode_picture(bytes, std::uint64_t{1} << 20);
  if (!texture) check_error(texture.error());
}

struct Reader {
  std::string_view name;
  const char* file;  ///< Whose extension tells the format.
  void (*read)(const Path&);
};

constexpr Reader kReaders[] = {
    {"obj", "input.obj", read_mesh},        {"ply", "input.ply", read_mesh},
    {"stl", "input.stl", read_mesh},        {"mesh", "input.mesh", read_mesh},
    {"zst", "input.mesh.zst", read_mesh},   {"gltf", "input.gltf", read_gltf},
    {"glb", "input.glb", read_gltf},        {"hair", "input.hair", read_shapes},
    {"xyzr", "input.xyzr", read_shapes},    {"scene", "input.scene", read_scene},
    {"json", "input.json", read_scene},     {"tree", "tree.json", read_tree},
    {"exr", "input.exr", read_exr},         {"picture", "", nullptr},
    {"rays", "input.rays", read_rays},      {"hits", "input.hits", read_hits},
    {"paths", "input.paths", read_paths},   {"queries", "input.queries", read_queries},
    {"parts", "input.json", read_manifest}, {"part-data", "input.data", read_part_data},
};

const Reader* chosen = nullptr;
Path input;

/// A folder in memory, where there is one.
Path make_folder() {
  std::string name = std::filesystem::exists("/dev/shm") ? "/dev/shm/" : "/tmp/";
  name += "hiprt-fuzz-XXXXXX";
  require(mkdtemp(name.data()) != nullptr, "cannot make a folder");
  return name;
}

void remove_folder() {
  std::error_code ignored;
  std::filesystem::remove_all(input.parent_path(), ignored);
}

void write_input(const std::uint8_t* data, std::size_t size) {
  const int file = open(input.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  require(file >= 0 && write(file, data, size) == static_cast<ssize_t>(size), "cannot write the input");
  close(file);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  constexpr std::string_view kOption = "--reader=";
  for (int i = 1; i < *count; ++i) {
    const std::string_view argument = (*arguments)[i];
    if (!argument.starts_with(kOption)) continue;
    for (const Reader& reader : kReaders)
      if (argument.substr(kOption.size()) == reader.name) chosen = &reader;
  }
  if (chosen == nullptr) {
    std::fprintf(stderr, "usage: fuzz_readers --reader=NAME [libFuzzer's options] [FOLDER]. NAME is one of:");
    for (const Reader& reader : kReaders) std::fprintf(stderr, " %s", std::string(reader.name).c_str());
    std::fprintf(stderr, "\n");
    std::exit(2);
  }
  if (chosen->read != nullptr) {
    input = make_folder() / chosen->file;
    std::atexit(remove_folder);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (chosen->read == nullptr) {
    read_picture(std::as_bytes(std::span(data, size)));
    return 0;
  }
  write_input(data, size);
  chosen->read(input);
  return 0;
}
