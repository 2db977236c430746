#pragma once
/// The container: file header, section table, geometry table. Normative text: hiprt_device/docs/FORMAT.md.
///
///     0    FileHeader (128 B)
///     128  SectionEntry[section_count] (32 B each)
///     ...  sections, each aligned to 128 B, zero bytes between them
///
/// All integers and floats are little-endian. Offsets count bytes from the start of the file. So the whole file can be
/// mapped, or copied to a GPU in one piece, and used without changes. The start must be aligned to 256 bytes there.

#include <hiprt_device/format/node.h>

namespace hiprt {

static_assert(std::endian::native == std::endian::little,
              "BVH files are little-endian and are used without conversion");

/// The first bytes of a file, and the alignments in memory of its sections and of the file itself.
inline constexpr char kMagic[8] = {'H', 'I', 'P', 'R', 'T', 'B', 'V', 'H'};
inline constexpr std::uint16_t kVersionMajor = 1;
inline constexpr std::uint16_t kVersionMinor = 8;
inline constexpr std::uint64_t kSectionAlignment = 128;
inline constexpr std::uint64_t kBufferAlignment = 256;
/// The maximal number of sections. It keeps the check of a hostile file cheap.
inline constexpr std::uint32_t kMaxSections = 64;

/// Features that a tracer must support to trace a scene (bit set of FileHeader::features).
enum class Feature : std::uint64_t {
  kTriangles = 1u << 0,        ///< Triangle leaves.
  kMasks = 1u << 1,            ///< Some geometry's mask is not 0xffffffff.
  kSplitReferences = 1u << 2,  ///< Some primitive is in several leaves (spatial splits).
  kCustom = 1u << 3,           ///< Custom leaves.
  kInstances = 1u << 4,        ///< The primitives are instances of objects (instance.h).
  kMotion = 1u << 5,           ///< Some instance moves (motion.h).
  kMovingBoxes = 1u << 6,      ///< Leaves of instances have one box at the begin and one at the end of the shutter.
  kWidenedBoxes = 1u << 7,     ///< Boxes exceed their content by FileHeader::box_margin (widened_boxes.h).
};
using FeatureMask = std::uint64_t;
HIPRT_HD constexpr FeatureMask feature_bit(Feature feature) { return static_cast<FeatureMask>(feature); }
/// All feature bits of this version. A file with any other bit is refused.
inline constexpr FeatureMask kKnownFeatures = feature_bit(Feature::kTriangles) | feature_bit(Feature::kMasks) |
                                              feature_bit(Feature::kSplitReferences) | feature_bit(Feature::kCustom) |
                                              feature_bit(Feature::kInstances) | feature_bit(Feature::kMotion) |
                                              feature_bit(Feature::kMovingBoxes) | feature_bit(Feature::kWidenedBoxes);
/// What files may have beyond the features of a tracer's code. Without motion boxes stand still, and wider boxes suit
/// every box test.
inline constexpr FeatureMask kFeaturesWithoutCode =
    feature_bit(Feature::kMovingBoxes) | feature_bit(Feature::kWidenedBoxes);

struct FileHeader {
  char magic[8];                ///< "HIPRTBVH"
  std::uint16_t version_major;  ///< A reader refuses every other major version than its own.
  std::uint16_t version_minor;  ///< A larger minor version may have new sections or flags, which may be ignored.
  std::uint32_t layout;         ///< NodeLayout
  std::uint64_t features;       ///< FeatureMask
  std::uint64_t byte_size;      ///< Bytes of the whole file.
  std::uint64_t checksum;       ///< XXH3-64 (seed 0) of bytes [0, 32) followed by [40, byte_size).
  std::uint32_t section_count;
  NodeRef root;               ///< kInvalidRef for an empty scene.
  std::uint32_t stack_bound;  ///< The most entries that a depth-first traversal in any child order can have on its
                              ///< stack.
  std::uint32_t geometry_count;
  Box bounds;                     ///< Box of all primitives; the empty box for an empty scene.
  std::uint64_t primitive_count;  ///< Sum over the geometries, dropped primitives included.
  std::uint32_t levels;  ///< Number of instances on the longest path from here to a primitive; 0: there are none.
  float condition;  ///< How much all transforms from here to a primitive magnify rounding (decision 0014); 0 without
                    ///< instances.
  float reach;  ///< The largest distance from the origin to an object's origin, over all levels; 0 without instances.
  /// With kMovingBoxes (time - shutter_begin) * shutter_rate is 0 at the shutter's begin and 1 at its end. Otherwise
  /// both are 0.
  float shutter_begin, shutter_rate;
  float box_margin;  ///< By how much boxes are wider than their content, on every side; 0 without kWidenedBoxes.
  std::uint32_t reserved[4];
};

enum class SectionKind : std::uint32_t {
  kNodes = 1,         ///< Box nodes of the file's layout.
  kLeaves = 2,        ///< Leaves of the file's layout.
  kPrimitiveMap = 3,  ///< uint32 per primitive, geometry by geometry: leaf number * 2 + its index in the leaf, or
                      ///< kInvalidId if dropped.
  kGeometries = 4,    ///< GeometryRecord
  kProvenance = 5,    ///< UTF-8 JSON: tool, version, builder, options, hash of the input, statistics.
  kInstances = 6,     ///< InstanceRecord; custom primitive i stands for record i.
  kObjects = 7,       ///< ObjectRecord
  kObjectFiles = 8,  ///< The objects' files, each at a multiple of kBufferAlignment from the start of the scene's file.
  kMotions = 9,      ///< MotionRecord; record i belongs to instance i.
  kMotionSegments = 10,  ///< MotionSegment
  kShapes = 11,          ///< ShapeRecord; record i belongs to geometry i.
  kShapePoints = 12,     ///< ShapePoint
  kCurveSegments = 13,   ///< uint32 per segment: its first point, counted from the geometry's first.
  kObjectShapes = 14,    ///< uint64 per object: offset of kShapes in its file, or 0.
};

/// A bit of SectionEntry::flags: a reader that does not know the kind must refuse the file. Without the bit the reader
/// skips the section.
inline constexpr std::uint32_t kSectionRequired = 1;

struct SectionEntry {
  std::uint32_t kind;  ///< SectionKind
  std::uint32_t flags;
  std::uint64_t offset;  ///< Multiple of kSectionAlignment.
  std::uint64_t count;   ///< Number of elements.
  std::uint64_t stride;  ///< Bytes per element.
};

struct GeometryRecord {
  std::uint64_t first_primitive;  ///< Number of the geometry's first primitive, in the numbering over all geometries.
  std::uint64_t primitive_count;  ///< Number of primitives, including dropped ones.
  std::uint64_t dropped_count;    ///< Number of primitives that are in no leaf (not finite, degenerate or inverted).
  std::uint32_t mask;             ///< A ray sees the geometry iff (ray.mask & mask) != 0.
  std::uint32_t flags;            ///< Bit 0 kGeometryCustom; bits 31-8 type; others zero.
};

/// A bit of GeometryRecord::flags: the primitives are custom, in custom leaves.
inline constexpr std::uint32_t kGeometryCustom = 1;
/// The largest type of a geometry.
inline constexpr std::uint32_t kMaxGeometryType = (1u << 24) - 1;
/// The program's own number for what the geometry's primitives are. It selects functors and filters.
HIPRT_HD constexpr std::uint32_t geometry_type(std::uint32_t geometry_flags) { return geometry_flags >> 8; }
/// @param type up to kMaxGeometryType.
HIPRT_HD constexpr std::uint32_t mesh_flags(std::uint32_t type) { return type << 8; }
/// @param type up to kMaxGeometryType.
HIPRT_HD constexpr std::uint32_t custom_geometry_flags(std::uint32_t type) { return kGeometryCustom | type << 8; }

static_assert(sizeof(FileHeader) == 128 && sizeof(SectionEntry) == 32 && sizeof(GeometryRecord) == 32);
#if !HIPRT_RUN_TIME_COMPILER  // Run-time compilers have no offsetof.
static_assert(offsetof(FileHeader, magic) == 0 && offsetof(FileHeader, version_major) == 8);
static_assert(offsetof(FileHeader, version_minor) == 10 && offsetof(FileHeader, layout) == 12);
static_assert(offsetof(FileHeader, features) == 16 && offsetof(FileHeader, byte_size) == 24);
static_assert(offsetof(FileHeader, checksum) == 32 && offsetof(FileHeader, section_count) == 40);
static_assert(offsetof(FileHeader, root) == 44 && offsetof(FileHeader, stack_bound) == 48);
static_assert(offsetof(FileHeader, geometry_count) == 52 && offsetof(FileHeader, bounds) == 56);
static_assert(offsetof(FileHeader, primitive_count) == 80 && offsetof(FileHeader, levels) == 88);
static_assert(offsetof(FileHeader, condition) == 92 && offsetof(FileHeader, reach) == 96);
static_assert(offsetof(FileHeader, shutter_begin) == 100 && offsetof(FileHeader, shutter_rate) == 104);
static_assert(offsetof(FileHeader, box_margin) == 108 && offsetof(FileHeader, reserved) == 112);
static_assert(offsetof(SectionEntry, kind) == 0 && offsetof(SectionEntry, flags) == 4);
static_assert(offsetof(SectionEntry, offset) == 8 && offsetof(SectionEntry, count) == 16);
static_assert(offsetof(SectionEntry, stride) == 24);
static_assert(offsetof(GeometryRecord, first_primitive) == 0 && offsetof(GeometryRecord, primitive_count) == 8);
static_assert(offsetof(GeometryRecord, dropped_count) == 16 && offsetof(GeometryRecord, mask) == 24);
static_assert(offsetof(GeometryRecord, flags) == 28);
#endif

}  // namespace hiprt
