// Files of geometries and scenes: the BVH files of this library.

#include <hiprt_build/file.h>
#include <hiprt_build/gpu/objects.h>
#include <hiprt_build/hiprt_api/scene.h>
#include <hiprt_build/open_scene.h>

#include <algorithm>

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
  if (!found || !found.member().built)
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
  if (found->member().report == nullptr)
    return gpu::fail(ErrorCode::kInvalidInput, "a geometry that was built in a batch cannot be saved");
  if (auto done = wait_for_all(); !done) return done;
  gpu::DeviceAllocator memory;
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
  if (parts->objects > parts->instances)
    return gpu::fail(ErrorCode::kInvalidInput, "a scene with scenes inside cannot be saved");
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
  report.nodes = static_cast<std::uint32_t>(file.view().nodes.count);
  report.leaves = static_cast<std::uint32_t>(file.view().leaves.count);
  report.geometries = file.view().header->geometry_count;
  return api::pool_of_one(allocator, scene->buffer.data(), report, nullptr);
}

Result<void> load_geometry(hiprtContextObject& context, hiprtGeometry& out, const char* path) {
  const auto file = open_scene(path);
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
  const auto file = open_scene(path);
  if (!file) return tl::unexpected(file.error());
  const BufferView& view = file->view();
  if (view.instances.empty() || view.layout() != NodeLayout::kPlanes)
    return gpu::fail(ErrorCode::kInvalidInput, path, ": not a scene of layout planes");
  auto pool = load(*file);
  if (!pool) return tl::unexpected(pool.error());
  (*pool)->members[0].report = nullptr;
  out = (*pool)->header(0);
  // A scene with scenes inside cannot be inside of another one: its records are not one array.
  if (std::all_of(view.objects.begin(), view.objects.end(), [](const auto& object) { return object.instances == 0; }))
    api::SceneRegistry::instance().set(out, {static_cast<std::uint32_t>(view.instances.size()),
                                             static_cast<std::uint32_t>(view.objects.size()), nullptr, 0});
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
