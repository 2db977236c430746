#pragma once
/// The records of a BVH file that a ray reads: node references, box nodes and leaves.
///
/// Normative text: hiprt_device/docs/FORMAT.md. Every offset is asserted below, and a test compares it with the text.
/// Layouts `float` and `half` are bit-compatible with AMD's image_bvh_intersect_ray (RDNA2/RDNA3: box32, box16 and
/// triangle nodes).

#include <hiprt_device/format/portability.h>

namespace hiprt {

/// How the bytes of box nodes and leaves are arranged. A file has one layout.
enum class NodeLayout : std::uint32_t {
  kFloat = 1,   ///< 128-byte box node with a {min, max} box per child; hardware-compatible.
  kPlanes = 2,  ///< The same values with the four children's planes side by side: the layout for CPU vector registers.
  kHalf = 3,    ///< 64-byte box16 node with a half-float {min, max} box per child; hardware-compatible.
  kQuantized = 4,  ///< 64-byte node with the planes as bytes on a grid per axis, side by side.
};

/// Low three bits of a node reference.
enum class NodeType : std::uint32_t {
  kTriangle0 = 0,
  kTriangle1 = 1,
  kTriangle2 = 2,
  kTriangle3 = 3,
  kBox16 = 4,  ///< Box node of layout half.
  kBox32 = 5,  ///< Box node of the file's layout (any but half).
  kInstance = 6,
  kProcedural = 7,  ///< A run of custom leaves.
};

/// Node reference = (byte offset from the start of the file / 64) << 3 | NodeType.
using NodeRef = std::uint32_t;

/// The reference of an absent child, and the number of an absent primitive. Node references count in units of 64
/// bytes.
inline constexpr NodeRef kInvalidRef = 0xffffffffu;
inline constexpr std::uint32_t kInvalidId = 0xffffffffu;
inline constexpr std::uint64_t kNodeGranularity = 64;
/// The first byte offset that a node reference cannot express: the last slot with type 7 is kInvalidRef.
inline constexpr std::uint64_t kAddressLimit = ((std::uint64_t{1} << 29) - 1) * kNodeGranularity;
inline constexpr unsigned kBranching = 4;

/// @param byte_offset multiple of 64 below kAddressLimit.
HIPRT_HD constexpr NodeRef make_ref(std::uint64_t byte_offset, NodeType type) {
  return static_cast<NodeRef>(byte_offset / kNodeGranularity) << 3 | static_cast<NodeRef>(type);
}
HIPRT_HD constexpr NodeType ref_type(NodeRef ref) { return static_cast<NodeType>(ref & 7u); }
HIPRT_HD constexpr std::uint64_t ref_offset(NodeRef ref) {
  return static_cast<std::uint64_t>(ref >> 3) * kNodeGranularity;
}
/// Types kBox16 and kBox32. False for kInvalidRef.
HIPRT_HD constexpr bool is_box(NodeRef ref) { return (ref & 6u) == static_cast<NodeRef>(NodeType::kBox16); }

/// Axis-aligned box. Absent children have the empty box: min = +inf, max = -inf.
struct Box {
  float min[3];
  float max[3];
};

/// Bits of child_flags, one byte per child, as in GPURT: what is below the child.
inline constexpr std::uint32_t kChildOnlyOpaque = 1;
inline constexpr std::uint32_t kChildOnlyNonOpaque = 2;
inline constexpr std::uint32_t kChildOnlyTriangles = 4;
inline constexpr std::uint32_t kChildOnlyProcedural = 8;

/// Box node of layout `float`.
struct alignas(128) FloatBoxNode {
  NodeRef child[kBranching];
  Box box[kBranching];
  std::uint32_t child_flags;
  std::uint32_t reserved[3];
};

/// Box node of layout `planes`: plane[axis][side][child], side 0 = minimum, 1 = maximum.
struct alignas(64) PlanesBoxNode {
  NodeRef child[kBranching];
  float plane[3][2][kBranching];
  std::uint32_t child_flags;
  std::uint32_t reserved[3];
};

/// Box node of layout `half`: 16-bit floats (half.h), rounded outwards. Infinite planes are legal.
struct alignas(64) HalfBoxNode {
  struct HalfBox {
    std::uint16_t min[3];
    std::uint16_t max[3];
  };
  NodeRef child[kBranching];
  HalfBox box[kBranching];
};

/// Box node of layout `quantized` (quantize.h): plane = origin + plane[axis][side][child] * 2^(exponent - 127).
struct alignas(64) QuantizedBoxNode {
  float origin[3];
  std::uint8_t exponent[3];  ///< 1 to 254.
  std::uint8_t children;     ///< Bits 3-0: slots in use; 5-4: axis along which the children spread most; 7-6: zero.
  NodeRef child[kBranching];
  std::uint8_t plane[3][2][kBranching];
  std::uint32_t child_flags;
  std::uint32_t reserved;
};

/// The part of a leaf that all layouts share (bytes 48-63).
///
/// A triangle leaf has triangle 0 = (v0, v1, v2) and, if primitive[1] != kInvalidId, triangle 1 = (v1, v3, v2). Both
/// are of one geometry. A child reference names the first leaf of a run. The run ends at the leaf whose kLastInRun bit
/// is set. All leaves of a run are of one kind: kTriangle0 names triangle leaves, kProcedural custom leaves.
struct LeafInfo {
  std::uint32_t primitive[2];        ///< Index of the primitive in its geometry.
  std::uint32_t geometry_and_flags;  ///< Bits 0-27 geometry, bit 31 kLastInRun, others zero.
  std::uint32_t triangle_ids;        ///< One triangle-id byte per primitive (byte 0, byte 1); see TriangleId.
};

/// Parts of LeafInfo::geometry_and_flags.
inline constexpr std::uint32_t kLastInRun = 0x80000000u;
inline constexpr std::uint32_t kGeometryMask = 0x0fffffffu;
/// The number of geometries that a leaf can name.
inline constexpr std::uint64_t kMaxGeometries = std::uint64_t{kGeometryMask} + 1;

/// Leaf of layout `float`.
struct alignas(64) FloatLeaf {
  float vertex[4][3];
  LeafInfo info;
};

/// Leaf of layout `planes`: coordinate[axis][vertex].
struct alignas(64) PlanesLeaf {
  float coordinate[3][4];
  LeafInfo info;
};

/// A leaf of one or two custom primitives of one geometry, the same in every layout.
///
/// Without a second primitive, primitive[1] is kInvalidId, box[1] is the empty box, and the second id byte is 0.
///
/// In a leaf of an instance box[1] is the empty box, too. With kMovingBoxes the boxes are those at the begin and at
/// the end of the shutter, and the planes move linearly between them.
struct alignas(64) CustomLeaf {
  Box box[2];
  LeafInfo info;
};

/// The triangle-id byte.
///
/// Corners are counted in stored order: (v0, v1, v2) for triangle 0, (v1, v3, v2) for triangle 1. Bits 1:0 name the
/// stored corner whose weight is u: the mesh's corner 1. Bits 3:2 name the stored corner whose weight is v: the mesh's
/// corner 2.
struct TriangleId {
  static constexpr std::uint32_t kDoubleSided = 1u << 4;
  static constexpr std::uint32_t kFlip = 1u << 5;
  static constexpr std::uint32_t kProcedural = 1u << 6;
  static constexpr std::uint32_t kOpaque = 1u << 7;
  /// The byte of a custom primitive.
  static constexpr std::uint32_t kCustom = kProcedural | kOpaque;
  /// Stored corner of the mesh's corner 0, 1 or 2.
  HIPRT_HD static constexpr unsigned u_source(std::uint32_t id) { return id & 3u; }
  HIPRT_HD static constexpr unsigned v_source(std::uint32_t id) { return id >> 2 & 3u; }
  /// @param rotation stored corner k is the mesh's corner (k + rotation) % 3.
  HIPRT_HD static constexpr std::uint32_t from_rotation(unsigned rotation) {
    return (4u - rotation) % 3u | (5u - rotation) % 3u << 2 | kOpaque;
  }
  /// The rotation from which the byte was made.
  HIPRT_HD static constexpr unsigned to_rotation(std::uint32_t id) { return (4u - u_source(id)) % 3u; }
};

static_assert(TriangleId::from_rotation(0) == 0x89, "unrotated: u of corner 1, v of corner 2, opaque");
static_assert(TriangleId::to_rotation(0x89) == 0 && TriangleId::to_rotation(0x84) == 1 &&
              TriangleId::to_rotation(0x82) == 2);

static_assert(sizeof(FloatBoxNode) == 128 && sizeof(PlanesBoxNode) == 128 && sizeof(Box) == 24);
#if !HIPRT_RUN_TIME_COMPILER  // Run-time compilers have no offsetof.
static_assert(offsetof(FloatBoxNode, child) == 0 && offsetof(FloatBoxNode, box) == 16);
static_assert(offsetof(FloatBoxNode, child_flags) == 112 && offsetof(FloatBoxNode, reserved) == 116);
static_assert(offsetof(PlanesBoxNode, child) == 0 && offsetof(PlanesBoxNode, plane) == 16);
static_assert(offsetof(PlanesBoxNode, child_flags) == 112 && offsetof(PlanesBoxNode, reserved) == 116);
static_assert(offsetof(Box, min) == 0 && offsetof(Box, max) == 12);
static_assert(sizeof(HalfBoxNode) == 64 && sizeof(HalfBoxNode::HalfBox) == 12 && sizeof(QuantizedBoxNode) == 64);
static_assert(offsetof(HalfBoxNode, child) == 0 && offsetof(HalfBoxNode, box) == 16);
static_assert(offsetof(HalfBoxNode::HalfBox, min) == 0 && offsetof(HalfBoxNode::HalfBox, max) == 6);
static_assert(offsetof(QuantizedBoxNode, origin) == 0 && offsetof(QuantizedBoxNode, exponent) == 12);
static_assert(offsetof(QuantizedBoxNode, children) == 15 && offsetof(QuantizedBoxNode, child) == 16);
static_assert(offsetof(QuantizedBoxNode, plane) == 32 && offsetof(QuantizedBoxNode, child_flags) == 56);
static_assert(offsetof(QuantizedBoxNode, reserved) == 60);
static_assert(sizeof(FloatLeaf) == 64 && sizeof(PlanesLeaf) == 64 && sizeof(LeafInfo) == 16);
static_assert(offsetof(FloatLeaf, vertex) == 0 && offsetof(FloatLeaf, info) == 48);
static_assert(offsetof(PlanesLeaf, coordinate) == 0 && offsetof(PlanesLeaf, info) == 48);
static_assert(sizeof(CustomLeaf) == 64 && offsetof(CustomLeaf, box) == 0 && offsetof(CustomLeaf, info) == 48);
static_assert(offsetof(LeafInfo, primitive) == 0 && offsetof(LeafInfo, geometry_and_flags) == 8);
static_assert(offsetof(LeafInfo, triangle_ids) == 12);
#endif

}  // namespace hiprt
