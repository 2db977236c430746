#pragma once
/// What a tracer needs of a BVH file: a small value that is passed to kernels.

#include <hiprt_build/format/view.h>
#include <hiprt_device/math/vec.h>

namespace hiprt {

/// A file in memory that the tracer can read, and the few header fields that every ray uses.
struct SceneView {
  const std::byte* base = nullptr;  ///< First byte of the file, in the memory of the processor that traces.
  std::uint64_t size = 0;           ///< Bytes of the file.
  const GeometryRecord* geometries = nullptr;
  NodeRef root = kInvalidRef;
  std::uint32_t stack_bound = 0;  ///< Stack entries a traversal may need.
  FeatureMask features = 0;
  NodeLayout layout = NodeLayout::kPlanes;
  Box bounds{};
  // Of a scene of instances; else as they are here.
  const InstanceRecord* instances = nullptr;
  const ObjectRecord* objects = nullptr;
  const MotionRecord* motions = nullptr;  ///< Of the scene's own instances, if any of these moves.
  std::uint32_t levels = 0;               ///< Instances on the longest way to a primitive.
  float condition = 0.0f, reach = 0.0f;
  float shutter_begin = 0.0f, shutter_rate = 0.0f;  ///< As in the header.
  /// Offset in the file of what SceneShapes reads: kShapes; of a scene of instances kObjectShapes. 0: there is none.
  std::uint64_t shapes = 0;
};

/// @param view of a file accepted by validate() or open_buffer(); from open_buffer() alone the content is trusted.
/// @param device_base where a copy of the file lies in the memory of the processor that traces (aligned to 256 bytes);
///        nullptr: the file is traced where it is.
inline SceneView make_scene_view(const BufferView& view, const std::byte* device_base = nullptr) {
  const std::byte* base = device_base != nullptr ? device_base : view.bytes.data();
  SceneView scene;
  scene.base = base;
  scene.size = view.bytes.size();
  scene.geometries = reinterpret_cast<const GeometryRecord*>(base + view.geometry_entry.offset);
  scene.root = view.header->root;
  scene.stack_bound = view.header->stack_bound;
  scene.features = view.header->features;
  scene.layout = view.layout();
  scene.bounds = view.header->bounds;
  scene.shapes = view.has_instances() ? view.object_shape_entry.offset : view.shape_entry.offset;
  if (!view.has_instances()) return scene;
  scene.instances = reinterpret_cast<const InstanceRecord*>(base + view.instance_entry.offset);
  scene.objects = reinterpret_cast<const ObjectRecord*>(base + view.object_entry.offset);
  if (!view.motions.empty()) scene.motions = reinterpret_cast<const MotionRecord*>(base + view.motion_entry.offset);
  scene.levels = view.header->levels;
  scene.condition = view.header->condition;
  scene.reach = view.header->reach;
  scene.shutter_begin = view.header->shutter_begin;
  scene.shutter_rate = view.header->shutter_rate;
  return scene;
}

}  // namespace hiprt
