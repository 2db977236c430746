#pragma once
/// Kernels of the library. Internal.

#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/hiprt_api/objects.h>

#include <hiprt/hiprt_types.h>

namespace hiprt::api {

/// Writes headers: view i goes to header i.
Result<void> enqueue_headers(const SceneView* views, ObjectHeader* headers, std::uint32_t count, hipStream_t stream);

/// After a refit that could be done: puts its view to @p view and into the header.
Result<void> enqueue_refitted(const gpu::RefitReport* report, SceneView* view, ObjectHeader* header,
                              hipStream_t stream);

/// The arrays of a hiprtSceneBuildInput, on the device.
struct SceneArrays {
  const hiprtInstance* instances;
  const hiprtTransformHeader* headers;  ///< nullptr: instance i has frame i.
  const void* frames;                   ///< nullptr: identities.
  const std::uint32_t* masks;           ///< nullptr: all bits.
  std::uint32_t instance_count, frame_count;
  hiprtFrameType type;

  /// Whether instances may have several frames.
  bool may_move() const { return headers != nullptr && frames != nullptr && frame_count > 1; }
};

/// What the builder over instances reads; device memory.
struct SceneParts {
  SceneView* views;  ///< Of the object of each instance. Empty for transforms without an inverse.
  gpu::DeviceInstance* instances;
  gpu::KeyRange* ranges;       ///< nullptr: nothing moves.
  build::MotionKey* keys;      ///< Of SRT frames;
  build::MatrixKey* matrices;  ///< or of matrices.
  /// In pinned memory: becomes 1 if an instance is of a scene. nullptr: nobody asks.
  std::uint32_t* has_inner;
};

Result<void> enqueue_parts(const SceneArrays& from, const SceneParts& to, hipStream_t stream);

/// A scene inside of another one. Its instance records are copied, because they name objects by their numbers in the
/// table of the outermost scene.
struct InnerScene {
  const ObjectHeader* scene;
  std::uint32_t instances;     ///< Of the scene itself; they come first in the copy.
  const InstanceRecord* more;  ///< Records of the scenes inside of it, in one array.
  std::uint32_t more_count;
  std::uint32_t objects;       ///< Size of its table.
  std::uint32_t first_object;  ///< Number of its first object in the outer table.
  InstanceRecord* copy;        ///< instances + more_count records.
};

/// Appends the objects and copies the records of an inner scene.
/// @param table of the outer scene.
Result<void> enqueue_inner(const InnerScene& inner, ObjectRecord* table, hipStream_t stream);
/// Points the objects that are inner scenes to the copies of their records.
/// @param copies of instance i, on the device; nullptr where it is of a geometry.
Result<void> enqueue_links(InstanceRecord* const* copies, ObjectRecord* table, std::uint32_t count, hipStream_t stream);

}  // namespace hiprt::api
