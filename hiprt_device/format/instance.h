#pragma once
/// Instances: objects of a scene, each with a transform. Normative text: hiprt_device/docs/FORMAT.md. Reasons:
/// hiprt_device/docs/decisions/0014-instances.md.

#include <hiprt_device/format/buffer.h>

namespace hiprt {

/// One instance.
///
/// point' = linear * (point - translation) transforms a point of the scene that has the instance to the object.
/// Directions are transformed by linear alone. An instance that moves has here the transform of its first key that has
/// an inverse (motion.h).
struct alignas(64) InstanceRecord {
  float linear[3][3];    ///< Rows; they and the inverse are finite.
  float translation[3];  ///< The object's origin in the scene; finite.
  std::uint32_t object;  ///< Index in the object table.
  std::uint32_t mask;    ///< A ray sees the instance iff (ray.mask & mask) != 0.
  std::uint32_t id;      ///< The program's own number.
  std::uint32_t flags;   ///< InstanceFlags; others zero.
};

/// Bits of InstanceRecord::flags.
struct InstanceFlags {
  /// Intersection filters are not called for hits in the instance: all hits count. For opaque geometry beside other
  /// geometry.
  static constexpr std::uint32_t kNoFilter = 1;
  static constexpr std::uint32_t kKnown = kNoFilter;
};

/// The node or run of the object where rays of this leaf start.
///
/// It is the object's root. An opened instance has several leaves, each with a node or run of its own.
HIPRT_HD inline NodeRef entered_ref(const LeafInfo& info) { return info.primitive[1]; }
/// The most levels of box nodes from an object's root to that node or run.
inline constexpr unsigned kMostOpenedLevels = 16;

/// One object: a BVH file inside the scene's file, with the part of its header that a ray needs.
struct ObjectRecord {
  std::uint64_t offset;       ///< Offset of the object's file in the scene's file; a multiple of kBufferAlignment.
  std::uint64_t size;         ///< Bytes of the object's file.
  std::uint64_t geometries;   ///< Offset of its kGeometries section in its file.
  std::uint64_t instances;    ///< Offset of its kInstances section in its file; 0: it has triangles and custom
                              ///< primitives.
  std::uint64_t features;     ///< FeatureMask of the object and of everything below it.
  Box bounds;                 ///< As in its header.
  NodeRef root;               ///< As in its header.
  float condition;            ///< As in its header.
  float reach;                ///< As in its header.
  std::uint32_t stack_bound;  ///< As in its header.
  std::uint32_t levels;       ///< As in its header.
  std::uint32_t reserved;
  std::uint64_t motions;  ///< Offset of its kMotions section in its file; 0: none of its instances moves.
};

static_assert(sizeof(InstanceRecord) == 64 && sizeof(ObjectRecord) == 96);
#if !HIPRT_RUN_TIME_COMPILER  // Run-time compilers have no offsetof.
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

/// The largest FileHeader::condition: transforms that magnify rounding more are refused.
inline constexpr float kMaxCondition = 0x1p40f;

/// Stack entries per entered instance, besides the entries of the object. They are kExitRef, the next node outside,
/// and the object's root.
inline constexpr std::uint32_t kInstanceStackEntries = 3;

}  // namespace hiprt
