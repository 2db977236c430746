// Files of geometries and scenes: the BVH files of this library.

#include <hiprt_build/file.h>
#include <hiprt_build/gpu/objects.h>
#include <hiprt_build/hiprt_api/scene.h>
#include <hiprt_build/open_scene.h>

#include <utility>
#include <vector>

using namespace hiprt;
using api::ErrorCode;
using api::Found;
using api::Result;

namespace {

Result<void> wait_for_all() { return gpu::check(hipDeviceSynchronize(), "hipDeviceSynchronize"); }

Result<void> upload(void* to, const void* from, std::size_t bytes) {
  return gpu::check(hipMemcpy(to, from, bytes, hipMemcpyHostToDevice), "hipMemcpy", bytes, " bytes");
}

Result<Found> built_object(const api::ObjectTable& table, const void* handle) {
  Found found = table.find(handle);
  if (!found || !found.is_built())
    return gpu::fail(ErrorCode::kInvalidInput, "the object is none of this context, or was not built");
  return found;
}

Result<void> write(Result<build::Buffer> file, const char* path) {
  if (!file) return tl::unexpected(std::move(file.error()));
  return build::write_file(path, std::as_const(*file).bytes());
}

Result<void> save_geometry(const hiprtContextObject& context, hiprtGeometry geometry, const char* path) {
  const auto found = built_object(context.geometries, geometry);
  if (!found) return tl::unexpected(found.error());
  if (auto done = wait_for_all(); !done) return done;
  gpu::DeviceAllocator memory;
  if (found->member().report == nullptr)
    return write(gpu::download_file(found->pool->batch, static_cast<std::uint32_t>(found->index), nullptr, memory),
                 path);
  const auto scene = gpu::compact(found->member().report, nullptr, memory);
  if (!scene) return tl::unexpected(scene.error());
  return write(gpu::download_file(*scene, "hiprtSaveGeometry", nullptr), path);
}

/// The object table of a scene with addresses as offsets, on the device.
Result<api::Allocation> absolute_objects(const void* scene, std::uint32_t count) {
  SceneView view;
  std::vector<ObjectRecord> objects(count);
  const std::size_t bytes = objects.size() * sizeof(ObjectRecord);
  auto done = gpu::check(hipMemcpy(&view, scene, sizeof(view), hipMemcpyDeviceToHost), "hipMemcpy");
  if (done) done = gpu::check(hipMemcpy(objects.data(), view.objects, bytes, hipMemcpyDeviceToHost), "hipMemcpy");
  if (!done) return tl::unexpected(std::move(done.error()));
  for (ObjectRecord& object : objects) object.offset += reinterpret_cast<std::uintptr_t>(view.base);
  auto memory = api::Allocation::make(bytes);
  if (memory) done = upload(memory->data(), objects.data(), bytes);
  if (!done) return tl::unexpected(std::move(done.error()));
  return memory;
}

Result<void> save_scene(const hiprtContextObject& context, hiprtScene handle, const char* path) {
  const auto found = built_object(context.scenes, handle);
  if (!found) return tl::unexpected(found.error());
  const auto parts = api::SceneRegistry::instance().find(handle);
  const gpu::InstanceReport* const report = found->member().instances;
  if (!parts || report == nullptr)
    return gpu::fail(ErrorCode::kInvalidInput, "a scene that was loaded cannot be saved");
  if (auto done = wait_for_all(); !done) return done;
  auto records = absolute_objects(handle, parts->objects);
  if (!records) return tl::unexpected(std::move(records.error()));
  const gpu::SceneObjects objects =
      gpu::separate_objects(reinterpret_cast<const ObjectRecord*>(records->data()), parts->objects);
  const auto read = gpu::read_report(report, objects, nullptr);
  if (!read) return tl::unexpected(read.error());
  return write(gpu::download_file(*read, objects, nullptr), path);
}

/// A pool of one object with a checked file.
Result<std::shared_ptr<api::Pool>> load(const SceneFile& file) {
  api::HeadroomAllocator allocator(api::kHeadroom);
  const auto scene = gpu::upload_scene(file.view(), nullptr, allocator);
  if (!scene) return tl::unexpected(scene.error());
  gpu::BuildReport report;
  report.view = scene->view;
  report.nodes = static_cast<std::uint32_t>(file.view().node_count());
  report.leaves = static_cast<std::uint32_t>(file.view().leaves.count);
  report.geometries = file.view().header->geometry_count;
  return api::pool_of_one(allocator, scene->buffer.data(), report, nullptr);
}

/// Puts the instance records of the scenes inside a loaded scene into one array, as those of a built one are. The array
/// becomes late[0] of the pool.
/// @return its length.
Result<std::uint32_t> gather_inner(const BufferView& file, api::Pool& pool) {
  std::vector<ObjectRecord> objects(file.objects.begin(), file.objects.end());
  std::vector<InstanceRecord> records;
  std::vector<std::size_t> first;
  for (const ObjectRecord& object : objects) {
    first.push_back(records.size());
    if (object.instances == 0) continue;
    const std::byte* const at = file.bytes.data() + object.offset;
    const auto* const begin = reinterpret_cast<const InstanceRecord*>(at + object.instances);
    records.insert(records.end(), begin, begin + reinterpret_cast<const FileHeader*>(at)->primitive_count);
  }
  if (records.empty()) return 0;
  const std::size_t bytes = records.size() * sizeof(InstanceRecord);
  auto memory = api::Allocation::make(bytes);
  if (!memory) return tl::unexpected(std::move(memory.error()));
  SceneView view;
  auto done = upload(memory->data(), records.data(), bytes);
  if (done) done = gpu::check(hipMemcpy(&view, pool.header(0), sizeof(view), hipMemcpyDeviceToHost), "hipMemcpy");
  // Offsets count from the object, modulo 2^64.
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (objects[i].instances != 0)
      objects[i].instances = reinterpret_cast<std::uintptr_t>(memory->data()) + first[i] * sizeof(InstanceRecord) -
                             (reinterpret_cast<std::uintptr_t>(view.base) + objects[i].offset);
  if (done)
    done = upload(const_cast<ObjectRecord*>(view.objects), objects.data(), objects.size() * sizeof(ObjectRecord));
  if (!done) return tl::unexpected(std::move(done.error()));
  pool.late[0] = std::move(*memory);
  return static_cast<std::uint32_t>(records.size());
}

/// The file's bytes are checked, then copied: they must be the same both times, so the file is not mapped.
Result<SceneFile> read_scene(const char* path) {
  auto bytes = build::read_file(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return open_scene(*std::move(bytes), path);
}

Result<void> load_geometry(hiprtContextObject& context, hiprtGeometry& out, const char* path) {
  const auto file = read_scene(path);
  if (!file) return tl::unexpected(file.error());
  if (!file->view().instances.empty() || file->view().layout() != NodeLayout::kPlanes)
    return gpu::fail(ErrorCode::kInvalidInput, path, ": not a geometry of layout planes");
  auto pool = load(*file);
  if (!pool) return tl::unexpected(pool.error());
  out = (*pool)->header(0);
  context.geometries.add(std::move(*pool));
  return {};
}

Result<void> load_scene(hiprtContextObject& context, hiprtScene& out, const char* path) {
  const auto file = read_scene(path);
  if (!file) return tl::unexpected(file.error());
  const BufferView& view = file->view();
  if (view.instances.empty() || view.layout() != NodeLayout::kPlanes)
    return gpu::fail(ErrorCode::kInvalidInput, path, ": not a scene of layout planes");
  auto pool = load(*file);
  if (!pool) return tl::unexpected(pool.error());
  (*pool)->members[0].report = nullptr;
  out = (*pool)->header(0);
  const auto inner = gather_inner(view, **pool);
  if (!inner) return tl::unexpected(inner.error());
  api::SceneRegistry::instance().set(
      out, {static_cast<std::uint32_t>(view.instances.size()), static_cast<std::uint32_t>(view.objects.size()),
            reinterpret_cast<const InstanceRecord*>((*pool)->late[0].data()), *inner});
  context.scenes.add(std::move(*pool));
  return {};
}

}  // namespace

hiprtError hiprtSaveGeometry(hiprtContext context, hiprtGeometry geometry, const char* file) {
  if (context == nullptr || geometry == nullptr || file == nullptr) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtSaveGeometry", [&] { return save_geometry(*context, geometry, file); });
}

hiprtError hiprtLoadGeometry(hiprtContext context, hiprtGeometry& out, const char* file) {
  if (context == nullptr || file == nullptr) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtLoadGeometry", [&] { return load_geometry(*context, out, file); });
}

hiprtError hiprtSaveScene(hiprtContext context, hiprtScene scene, const char* file) {
  if (context == nullptr || scene == nullptr || file == nullptr) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtSaveScene", [&] { return save_scene(*context, scene, file); });
}

hiprtError hiprtLoadScene(hiprtContext context, hiprtScene& out, const char* file) {
  if (context == nullptr || file == nullptr) return hiprtErrorInvalidParameter;
  return api::run(context, "hiprtLoadScene", [&] { return load_scene(*context, out, file); });
}
