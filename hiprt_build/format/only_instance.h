#pragma once
/// Finds out whether a scene is a single instance, which PlacedObject traces by policies without levels.

#include <hiprt_build/format/view.h>
#include <hiprt_device/instances/placed_object.h>

#include <optional>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// @param view of a file that validate() accepts, on the host.
/// @param device_base as in make_scene_view().
/// @return nothing unless the scene is one whole instance that stands still, of an object without instances.
inline std::optional<PlacedObject> only_instance(const BufferView& view, const std::byte* device_base = nullptr) {
  const NodeRef root = view.header->root;
  if (!view.has_instances() || is_box(root) || root == kInvalidRef || view.header->levels != 1) return std::nullopt;
  if ((view.header->features & (feature_bit(Feature::kMotion) | feature_bit(Feature::kMovingBoxes))) != 0)
    return std::nullopt;
  const LeafInfo& info = reinterpret_cast<const CustomLeaf*>(view.bytes.data() + ref_offset(root))->info;
  const ObjectRecord& record = view.objects[view.instances[info.primitive[0]].object];
  // The leaf must be alone in its run and lead to the object's root.
  if ((info.geometry_and_flags & kLastInRun) == 0 || entered_ref(info) != record.root) return std::nullopt;
  const auto object = open_buffer(view.object_file(record));
  if (!object) return std::nullopt;
  const std::byte* base = device_base != nullptr ? device_base : view.bytes.data();
  return PlacedObject{make_scene_view(view, device_base), make_scene_view(*object, base + record.offset),
                      info.primitive[0]};
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
