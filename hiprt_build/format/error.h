#pragma once
/// The ways in which bytes can fail to be a BVH file. Host only.

#include <hiprt_build/export.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace hiprt {

enum class FormatError : std::uint32_t {
  // Header and section table (open_buffer).
  kMisaligned,  ///< The bytes do not start at a multiple of 128 in memory.
  kTooSmall,    ///< Shorter than the file header.
  kBadMagic,
  kUnknownMajorVersion,
  kUnknownLayout,
  kUnknownFeature,     ///< A feature bit this version does not know.
  kSizeMismatch,       ///< FileHeader::byte_size differs from the number of bytes given (truncated or extended file).
  kBadReservedField,   ///< A field that must be zero is not.
  kSectionTableRange,  ///< The section table does not fit in the file.
  kSectionMisaligned,
  kSectionStride,  ///< A known section's stride is not its record's size.
  kSectionRange,   ///< offset + count * stride leaves the file (or overflows).
  kSectionOverlap,
  kDuplicateSection,
  kMissingSection,
  kUnknownRequiredSection,
  kGeometryCount,   ///< The geometry section's count differs from the header, or exceeds what a leaf can name.
  kPrimitiveCount,  ///< Header, geometry table and primitive map disagree.
  // Whole content (validate).
  kBadChecksum,
  kBadReference,     ///< A node reference of an unknown type, out of its section or not on a record boundary.
  kReferenceOrder,   ///< A child does not lie behind its parent: the tree could loop.
  kSharedNode,       ///< A node or leaf is reached more than once.
  kEmptyNode,        ///< A box node without children.
  kBadChildSlots,    ///< The children byte of a quantized node is not what its references say, or names no axis.
  kBadGrid,          ///< The origin or the exponent of a quantized node is out of range.
  kInexactPlane,     ///< A plane of a quantized node is not exactly a float, or out of range.
  kUnreachable,      ///< A node or leaf is not reached.
  kBadBox,           ///< NaN, infinite or inverted box of what is there, or a non-empty box of what is absent.
  kBoxNotContained,  ///< A child's content leaves the box its parent states.
  kBadBounds,        ///< The header's bounds are not the root's.
  kBadChildFlags,    ///< A child-flags byte is not what is below the child.
  kUnterminatedRun,  ///< A run of leaves passes the end of the section.
  kBadVertex,        ///< NaN or infinite coordinate.
  kBadGeometryId,    ///< Of no geometry, or of one of the other kind (triangles, custom).
  kBadPrimitiveId,
  kBadTriangleId,         ///< The triangle-id byte names no rotation, or is not a custom primitive's.
  kSplitWithoutFeature,   ///< A primitive is in several leaves, but the feature bit is not set.
  kSplitDiffers,          ///< The leaves of a split primitive hold different triangles.
  kSplitNotCovered,       ///< The boxes of a split primitive's references do not cover it.
  kSplitCustom,           ///< A custom primitive is in several leaves.
  kPrimitiveMapMismatch,  ///< The map names a leaf that does not hold the primitive, or calls a reachable one dropped.
  kDroppedCount,
  kFeatureMismatch,  ///< A feature bit is missing, or set although nothing in the file needs it.
  kStackBound,       ///< The header's stack bound is below what a traversal can need, or above any tree's need.
  kBadProvenance,    ///< Not a JSON object in UTF-8.
  // Instances and their objects.
  kBadLevels,          ///< The header's levels are not what the instances need.
  kBadTransformBound,  ///< The header's condition or reach is below what the transforms need, or not a number.
  kBadObject,          ///< An object lies outside its section, or its record is not what its file says.
  kBadInstance,        ///< An instance of no object before its own, or without an inverse.
  kInstanceLeaf,       ///< A leaf of instances holds two, or is not alone in its run.
  kBadMotion,  ///< The keys of a motion are not in their section, no numbers, not in order, or cannot be inverted.
  kBadShape,   ///< A geometry's shapes are not in their section, or not as many as its primitives; or a point or a
               ///< segment is none.
};

/// Number of enumerators.
inline constexpr std::size_t kFormatErrors = static_cast<std::size_t>(FormatError::kBadShape) + 1;

/// @return the enumerator without its k, e.g. "BadMagic"; a string literal.
HIPRT_BUILD_API const char* name(FormatError error);

/// How the numbers of a FormatIssue are stored.
enum class NumberKind : std::uint32_t {
  kInteger,
  kFloat,   ///< The bits of a float, in the low 32 bits.
  kDouble,  ///< The bits of a double.
};

/// What is wrong, where, and the numbers that show it.
struct FormatIssue {
  FormatError error;
  std::uint64_t offset;  ///< Byte offset in the file of the wrong field.
  std::uint64_t value;   ///< What was found. Of a plane in another encoding: the float that it stands for.
  std::uint64_t limit;   ///< What was expected, or the largest or smallest allowed value; the error says which.
  NumberKind number = NumberKind::kInteger;  ///< Of value and limit.
};

/// One sentence that ends with the byte offset and the name of the error.
/// E.g. "210338 bytes, but its header says 420677: the file is truncated (byte 24, SizeMismatch)".
HIPRT_BUILD_API std::string to_string(const FormatIssue& issue);

}  // namespace hiprt
