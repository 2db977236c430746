#include <tools/scene_io/scene/scene_binary.h>

#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/read_input.h>
#include <tools/scene_io/scene/scene_order.h>

#include <hiprt_build/file.h>

#include <cstring>
#include <new>

namespace hiprt::tools {
namespace {

using build::Instance;

constexpr std::uint32_t kMagic = 0x314e4353;
constexpr std::uint64_t kChildBytes = sizeof(std::uint32_t) + sizeof(build::Affine);
static_assert(sizeof(build::Affine) == 48 && sizeof(build::Position) == 12 && sizeof(build::Triangle) == 12);

/// The bytes of a file, taken from the front.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> all) : rest_(all) {}

  std::size_t left() const { return rest_.size(); }
  /// @pre as many are left.
  void take(void* to, std::size_t size) {
    if (size == 0) return;
    std::memcpy(to, rest_.data(), size);
    rest_ = rest_.subspan(size);
  }
  template <class T> T take() {
    T value;
    take(&value, sizeof(value));
    return value;
  }

 private:
  std::span<const std::byte> rest_;
};

/// What a number in the file stands for: objects are numbered as they come.
struct FileObject {
  bool group;
  std::size_t number;  ///< Among the meshes, or the groups.
};

/// Meshes and groups of a file; the groups' instances name the file's objects.
struct FileScene {
  std::vector<FileObject> objects;
  std::vector<std::size_t> mesh_objects, group_objects;  ///< Their numbers in the file.
  std::vector<Mesh> meshes;
  std::vector<std::vector<Instance>> groups;
};

std::string location(std::size_t object) { return "object " + std::to_string(object); }

tl::unexpected<build::Error> cut(std::size_t object, std::uint64_t needed, std::uint64_t left) {
  return invalid_input(location(object) + ": needs " + std::to_string(needed) + " bytes, " + std::to_string(left) +
                       " are left in the file");
}

build::Result<void> read_mesh(Bytes& bytes, FileScene& scene, std::size_t object) {
  if (bytes.left() < 8) return cut(object, 8, bytes.left());
  const auto vertices = bytes.take<std::uint32_t>(), triangles = bytes.take<std::uint32_t>();
  const std::uint64_t needed = 12 * (std::uint64_t{vertices} + triangles);
  if (bytes.left() < needed) return cut(object, needed, bytes.left());
  Mesh& mesh = scene.meshes.emplace_back();
  mesh.name = location(object);
  mesh.positions.resize(vertices);
  mesh.triangles.resize(triangles);
  bytes.take(mesh.positions.data(), std::size_t{12} * vertices);
  bytes.take(mesh.triangles.data(), std::size_t{12} * triangles);
  for (std::size_t i = 0; i < triangles; ++i)
    for (const std::uint32_t index : mesh.triangles[i])
      if (index >= vertices)
        return invalid_input(location(object) + ", triangle " + std::to_string(i) + ": vertex " +
                             std::to_string(index) + ", but only " + std::to_string(vertices) + " vertices are there");
  scene.objects.push_back({false, scene.mesh_objects.size()});
  scene.mesh_objects.push_back(object);
  return {};
}

build::Result<void> read_group(Bytes& bytes, FileScene& scene, std::size_t object) {
  if (bytes.left() < 4) return cut(object, 4, bytes.left());
  const auto children = bytes.take<std::uint32_t>();
  if (bytes.left() < children * kChildBytes) return cut(object, children * kChildBytes, bytes.left());
  std::vector<Instance> instances(children);
  for (std::uint32_t i = 0; i < children; ++i) {
    instances[i].object = bytes.take<std::uint32_t>();
    instances[i].to_scene = bytes.take<build::Affine>();
    instances[i].id = i;
    if (instances[i].object >= object)
      return invalid_input(location(object) + ", child " + std::to_string(i) + ": object " +
                           std::to_string(instances[i].object) + ", those before the group are " +
                           std::to_string(object));
  }
  scene.groups.push_back(std::move(instances));
  scene.objects.push_back({true, scene.group_objects.size()});
  scene.group_objects.push_back(object);
  return {};
}

build::Result<FileScene> read_objects(std::span<const std::byte> all) {
  Bytes bytes(all);
  if (bytes.left() < 8 || bytes.take<std::uint32_t>() != kMagic)
    return invalid_input("not a .scene file: it does not begin with SCN1 and a number of objects");
  const auto count = bytes.take<std::uint32_t>();
  if (count == 0) return invalid_input("0 objects, 1 or more expected");
  FileScene scene;
  for (std::size_t object = 0; object < count; ++object) {
    if (interrupted()) return cancelled();
    if (bytes.left() < 4) return cut(object, 4, bytes.left());
    const auto kind = bytes.take<std::uint32_t>();
    if (kind > 1)
      return invalid_input(location(object) + ": kind " + std::to_string(kind) + ", known are 0 (mesh) and 1 (group)");
    auto done = kind == 0 ? read_mesh(bytes, scene, object) : read_group(bytes, scene, object);
    if (!done) return tl::unexpected(std::move(done.error()));
  }
  if (bytes.left() != 0) return invalid_input(std::to_string(bytes.left()) + " bytes are left behind the last object");
  return scene;
}

/// A scene that is a mesh: one instance of it.
void wrap_mesh(FileScene& scene) {
  if (scene.objects.back().group) return;
  scene.groups.push_back({Instance{.object = static_cast<std::uint32_t>(scene.objects.size() - 1)}});
  scene.objects.push_back({true, scene.group_objects.size()});
  scene.group_objects.push_back(scene.objects.size() - 1);
}

/// Meshes first, then groups. Unused ones are left out.
SceneDescription arrange(FileScene scene) {
  wrap_mesh(scene);
  const std::size_t meshes = scene.meshes.size();
  for (auto& group : scene.groups)
    for (Instance& instance : group) {
      const FileObject object = scene.objects[instance.object];
      instance.object = static_cast<std::uint32_t>(object.group ? meshes + object.number : object.number);
    }
  const GroupOrder order = order_groups(scene.groups, meshes, scene.groups.size() - 1);
  SceneDescription result;
  std::vector<std::uint32_t> numbers(meshes + scene.groups.size());
  for (std::size_t i = 0; i < meshes; ++i) {
    if (!order.used_objects[i]) continue;
    numbers[i] = static_cast<std::uint32_t>(result.objects.size());
    result.objects.push_back({scene.meshes[i].name, {result.meshes.size()}});
    result.meshes.push_back(std::move(scene.meshes[i]));
  }
  for (const std::size_t g : order.groups) {
    numbers[meshes + g] = static_cast<std::uint32_t>(result.objects.size() + result.groups.size());
    for (Instance& instance : scene.groups[g]) instance.object = numbers[instance.object];
    result.groups.push_back({"objects[" + std::to_string(scene.group_objects[g]) + "]", std::move(scene.groups[g])});
  }
  return result;
}

/// A file's bytes, from the front.
class Writer {
 public:
  template <class T> void put(const T& value) { put(std::span(&value, 1)); }
  template <class T> void put(std::span<const T> values) {
    const auto bytes = std::as_bytes(values);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace

build::Result<void> write_scene_binary(const std::filesystem::path& path, const SceneDescription& scene) {
  Writer file;
  file.put(kMagic);
  file.put(static_cast<std::uint32_t>(scene.objects.size() + scene.groups.size()));
  for (const SceneObject& object : scene.objects) {
    const Mesh& mesh = scene.meshes[object.meshes.front()];
    file.put(std::uint32_t{0});
    file.put(static_cast<std::uint32_t>(mesh.positions.size()));
    file.put(static_cast<std::uint32_t>(mesh.triangles.size()));
    file.put(std::span<const build::Position>(mesh.positions));
    file.put(std::span<const build::Triangle>(mesh.triangles));
  }
  for (const SceneGroup& group : scene.groups) {
    file.put(std::uint32_t{1});
    file.put(static_cast<std::uint32_t>(group.instances.size()));
    for (const Instance& instance : group.instances) {
      file.put(instance.object);
      file.put(instance.to_scene);
    }
  }
  return build::write_file(path, file.bytes());
}

build::Result<SceneDescription> read_scene_binary(const std::filesystem::path& path) {
  const auto file = read_input(path);
  if (!file) return tl::unexpected(file.error());
  try {
    auto scene = read_objects(file->bytes());
    if (!scene) return tl::unexpected(build::Error{scene.error().code, path.string() + ": " + scene.error().message});
    SceneDescription result = arrange(std::move(*scene));
    result.path = path.string();
    return result;
  } catch (const std::bad_alloc& failure) {
    return tl::unexpected(not_enough_memory(path.native(), "to read it", failure));
  }
}

}  // namespace hiprt::tools
