#include <tools/scene_io/mesh/mesh_import.h>

#include <tools/base/errors.h>
#include <tools/base/memory_limit.h>
#include <tools/base/read_input.h>
#include <tools/base/text.h>
#include <tools/scene_io/mesh/mesh_assimp.h>
#include <tools/scene_io/mesh/mesh_formats.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>
#include <utility>

namespace hiprt::tools {
namespace {

enum class MeshFormat { kUnknown, kObj, kPly, kStl, kGltf, kRaw };

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

MeshFormat format_of_name(const std::filesystem::path& path) {
  const std::string name = lower(path.filename().string());
  constexpr std::array<std::pair<std::string_view, MeshFormat>, 7> kEndings{{{".obj", MeshFormat::kObj},
                                                                             {".ply", MeshFormat::kPly},
                                                                             {".stl", MeshFormat::kStl},
                                                                             {".gltf", MeshFormat::kGltf},
                                                                             {".glb", MeshFormat::kGltf},
                                                                             {".mesh", MeshFormat::kRaw},
                                                                             {".mesh.zst", MeshFormat::kRaw}}};
  for (const auto& [ending, format] : kEndings)
    if (name.ends_with(ending)) return format;
  return MeshFormat::kUnknown;
}

MeshFormat format_of_content(std::span<const std::byte> bytes) {
  std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  if (text.starts_with("glTF")) return MeshFormat::kGltf;
  if (starts_with_solid(bytes)) return MeshFormat::kStl;
  skip_byte_order_mark(text);
  if (text.starts_with("ply\n") || text.starts_with("ply\r")) return MeshFormat::kPly;
  return MeshFormat::kUnknown;
}

MeshFormat format_of(std::span<const std::byte> bytes, const std::filesystem::path& path) {
  const MeshFormat format = format_of_name(path);
  return format == MeshFormat::kUnknown ? format_of_content(bytes) : format;
}

build::Result<Mesh> read(std::span<const std::byte> bytes, const std::filesystem::path& path,
                         MaterialLibrary* library) {
  switch (format_of(bytes, path)) {
    case MeshFormat::kObj:
      return read_obj(bytes, library != nullptr);
    case MeshFormat::kPly:
      return read_ply(bytes, library != nullptr);
    case MeshFormat::kStl:
      return read_stl(bytes);
    case MeshFormat::kGltf:
      return read_gltf(bytes, path.parent_path(), library);
    case MeshFormat::kRaw:
      return read_raw_mesh(bytes);
    case MeshFormat::kUnknown:
      break;
  }
  const std::string extension = lower(path.extension().string());
  if (assimp_reads(extension)) return read_assimp(bytes, extension);
  return tl::unexpected(no_reader(extension));
}

build::Result<void> check_indices(const Mesh& mesh) {
  const std::size_t limit = mesh.positions.size();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (const std::uint32_t index : mesh.triangles[i])
      if (index >= limit)
        return invalid_input("triangle " + std::to_string(i) + " uses vertex " + std::to_string(index) + ", but only " +
                             std::to_string(limit) + " vertices are there");
  return {};
}

/// Messages of libraries may hold line breaks, and all of a file's data.
std::string one_line(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  constexpr std::size_t kMostBytes = 300;
  return shortened(text, kMostBytes);
}

build::Result<Mesh> read_checked(std::span<const std::byte> bytes, const std::filesystem::path& path,
                                 MaterialLibrary* library) {
  auto mesh = read(bytes, path, library);
  if (!mesh) return mesh;
  if (auto checked = check_indices(*mesh); !checked) return tl::unexpected(checked.error());
  mesh->name = path.filename().string();
  return mesh;
}

build::Result<MeshAssembly> read_assembly(std::span<const std::byte> bytes, const std::filesystem::path& path,
                                          const std::vector<float>& times, MaterialLibrary* library) {
  const MeshFormat format = format_of(bytes, path);
  const std::string name = path.filename().string(), extension = lower(path.extension().string());
  if (format == MeshFormat::kGltf) return read_gltf_assembly(bytes, path.parent_path(), name, times, library);
  if (format == MeshFormat::kUnknown && assimp_reads(extension)) return read_assimp_assembly(bytes, extension, name);
  auto mesh = read_checked(bytes, path, library);
  if (!mesh) return tl::unexpected(mesh.error());
  MeshAssembly result;
  result.warnings = std::move(mesh->warnings);
  result.meshes.push_back(std::move(*mesh));
  result.uses.push_back({0, {}});
  return result;
}

/// Calls read(bytes, path), adds the path to its errors and turns exceptions into errors.
template <class Read> auto load(const std::filesystem::path& path, const Read& read) -> decltype(read({}, path)) try {
  auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  auto result = read(std::as_const(*file).bytes(), path);
  if (!result)
    return tl::unexpected(build::Error{result.error().code, path.string() + ": " + one_line(result.error().message)});
  return result;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
} catch (const std::exception& error) {
  return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, path.string() + ": " + one_line(error.what())});
}

}  // namespace

build::Result<Mesh> load_mesh(const std::filesystem::path& path, MaterialLibrary* library) {
  return load(path, [&](std::span<const std::byte> bytes, const std::filesystem::path& from) {
    return read_checked(bytes, from, library);
  });
}

build::Result<MeshAssembly> load_assembly(const std::filesystem::path& path, const std::vector<float>& times,
                                          MaterialLibrary* library) {
  return load(path, [&](std::span<const std::byte> bytes, const std::filesystem::path& from) {
    return read_assembly(bytes, from, times, library);
  });
}

}  // namespace hiprt::tools
