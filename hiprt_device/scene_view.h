#pragma once
/// The part of a BVH file that a tracer needs: a small value that is passed to kernels.

#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/instance.h>
#include <hiprt_device/format/motion.h>
#include <hiprt_device/format/node.h>

namespace hiprt {

struct HostScene;

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
  // The following members are those of a scene of instances. In other scenes they keep these values.
  const InstanceRecord* instances = nullptr;
  const ObjectRecord* objects = nullptr;
  const MotionRecord* motions = nullptr;  ///< Motions of the scene's own instances; nullptr if none of them moves.
  std::uint32_t levels = 0;               ///< Number of instances on the longest path to a primitive.
  float condition = 0.0f, reach = 0.0f;
  float shutter_begin = 0.0f, shutter_rate = 0.0f;  ///< As in FileHeader.
  float box_margin = 0.0f;                          ///< As in FileHeader: of scenes without instances.
  /// Offset in the file of the section that SceneShapes reads: kShapes, or kObjectShapes in a scene of instances. 0:
  /// none.
  std::uint64_t shapes = 0;
  /// What the host has prepared; nullptr: nothing. Only hosts read it.
  const HostScene* host = nullptr;
};

}  // namespace hiprt
