#pragma once
/// Turns scenes on the device into objects that instances may refer to. Each scene may lie in a separate allocation.
/// The host copies nothing and waits for nothing.
///
///     auto built = hiprt::gpu::enqueue_build({&mesh, 1}, {}, output, scratch, stream);
///     auto hair = hiprt::gpu::enqueue_batch(batch, {}, batch_output, scratch, stream);
///     auto done = hiprt::gpu::enqueue_objects({{hiprt::gpu::object_of(*built)}}, records, stream);
///     if (done) done = hiprt::gpu::enqueue_objects(hair->views, strands, records + 1, stream);
///     hiprt::gpu::SceneObjects objects = hiprt::gpu::separate_objects(records, 1 + strands);

#include <hiprt_build/gpu/batch.h>
#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/gpu/refit.h>

namespace hiprt::gpu {

/// A scene on the device that instances may be of.
struct ObjectSource {
  const SceneView* view = nullptr;  ///< On the device, read when the stream passes enqueue_objects(); or
  SceneView known{};                ///< the view itself, if view is nullptr.
};

/// The scene that enqueue_build() makes.
inline ObjectSource object_of(const BuildReport* report) { return {&report->view, {}}; }
/// The scene that enqueue_refit() has moved.
inline ObjectSource object_of(const RefitReport* report) { return {&report->view, {}}; }
/// The scene of instances that enqueue_instances() makes. Its objects must keep their numbers in the outer scene.
inline ObjectSource object_of(const InstanceReport* report) { return {&report->view, {}}; }
inline ObjectSource object_of(const BuiltScene& scene) { return {nullptr, scene.view}; }
inline ObjectSource object_of(const DeviceScene& scene) { return {nullptr, scene.view}; }

/// Enqueues the records of objects. After a refit of an object its record must be made again, because it has the
/// object's bounds. The array @p sources is read before the call returns.
/// @param records on the device, one per source. They hold addresses, so the objects must stay where they are.
/// @return the errors of launches, or kInvalidInput for a null pointer.
Result<void> enqueue_objects(std::span<const ObjectSource> sources, ObjectRecord* records, hipStream_t stream);
/// The same for an array of views on the device, as enqueue_batch() makes it.
Result<void> enqueue_objects(const SceneView* views, std::uint32_t count, ObjectRecord* records, hipStream_t stream);

/// Objects with records of enqueue_objects().
/// @param layout of all objects.
inline SceneObjects separate_objects(const ObjectRecord* records, std::uint32_t count,
                                     NodeLayout layout = NodeLayout::kPlanes) {
  return {nullptr, records, count, layout};
}

}  // namespace hiprt::gpu
