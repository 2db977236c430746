#pragma once
/// Instances: objects of a scene, each with the place that it has there. Normative text: hiprt_device/docs/FORMAT.md,
/// why so: hiprt_device/docs/decisions/0014-instances.md.

#include <hiprt_device/format/buffer.h>

namespace hiprt {

/// One instance. point' = linear * (point - translation) takes a point of the scene that has the instance to the
/// object; directions take linear alone. Of an instance that moves: at its first key (motion.h).
struct alignas(64) InstanceRecord {
  float linear[3][3];    ///< Rows; finite, and so is the inverse.
  float translation[3];  ///< Where the object's origin is in the scene; finite.
  std::uint32_t object;  ///< Index in the object table.
  std::uint32_t mask;    ///< A ray sees the instance iff (ray.mask & mask) != 0.
  std::uint32_t id;      ///< The program's own number.
  std::uint32_t flags;   ///< InstanceFlags; others zero.
};

/// Of InstanceRecord::flags.
struct InstanceFlags {
  /// Intersection filters are not asked about hits in the instance: all count (opaque geometry, where others are not).
  static constexpr std::uint32_t kNoFilter = 1;
  static constexpr std::uint32_t kKnown = kNoFilter;
};

/// Where a leaf of instances lets rays into the object: its root, or one of the nodes and runs that an opened instance
/// is in as many leaves for.
HIPRT_HD inline NodeRef entered_ref(const LeafInfo& info) { return info.primitive[1]; }
/// How far below an object's root that may be, in box nodes.
inline constexpr unsigned kMostOpenedLevels = 16;

/// One object: a BVH file that the scene's file holds whole. What a ray needs of it stands here too.
struct ObjectRecord {
  std::uint64_t offset;       ///< Of the object's file in the scene's, a multiple of kBufferAlignment.
  std::uint64_t size;         ///< Bytes of the object's file.
  std::uint64_t geometries;   ///< Offset of its kGeometries section in it.
  std::uint64_t instances;    ///< Offset of its kInstances section in it; 0: it has triangles and custom primitives.
  std::uint64_t features;     ///< FeatureMask of it, and of all that is below.
  Box bounds;                 ///< As in its header.
  NodeRef root;               ///< As in its header.
  float condition;            ///< As in its header.
  float reach;                ///< As in its header.
  std::uint32_t stack_bound;  ///< As in its header.
  std::uint32_t levels;       ///< As in its header.
  std::uint32_t reserved;
  std::uint64_t motions;  ///< Offset of its kMotions section in it; 0: nothing of it moves by itself.
};

static_assert(sizeof(InstanceRecord) == 64 && sizeof(ObjectRecord) == 96);
#if !HIPRT_RUN_TIME_COMPILER  // They have no offsetof.
static_assert(offsetof(InstanceRecord, linear) == 0 && offsetof(InstanceRecord, translation) == 36);
static_assert(offsetof(InstanceRecord, object) == 48 && offsetof(InstanceRecord, mask) == 52);
static_assert(offsetof(InstanceRecord, id) == 56 && offsetof(InstanceRecord, flags) == 60);
static_assert(offsetof(ObjectRecord, offset) == 0 && offsetof(ObjectRecord, size) == 8);
static_assert(offsetof(ObjectRecord, geometries) == 16 && offsetof(ObjectRecord, instances) == 24);
static_assert(offsetof(ObjectRecord, features) == 32 && offsetof(ObjectRecord, bounds) == 40);
static_assert(offsetof(ObjectRecord, root) == 64 && offsetof(ObjectRecord, condition) == 68);
static_assert(offsetof(ObjectRecord, reach) == 72 && offsetof(ObjectRecord, stack_bound) == 76);
static_assert(offsetof(ObjectRecord, levels) == 80 && offsetof(ObjectRecord, reserved) == 84);
static_assert(offsetof(ObjectRecord, motions) == 88);
#endif

/// Of FileHeader::condition: transforms that magnify rounding more are refused.
inline constexpr float kMaxCondition = 0x1p40f;

/// What a traversal keeps on its stack for an instance that it is in, besides what it keeps of the object: the way out,
/// the node that comes next outside, and the object's root.
inline constexpr std::uint32_t kInstanceStackEntries = 3;

}  // namespace hiprt
