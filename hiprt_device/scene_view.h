#pragma once
/// What a tracer needs of a BVH file: a small value that is passed to kernels.

#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/instance.h>
#include <hiprt_device/format/motion.h>
#include <hiprt_device/format/node.h>

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

}  // namespace hiprt
