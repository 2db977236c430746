#pragma once
/// Faults of BVH files. Host only.

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
  kUnknownFeature,     ///< A feature bit that this version does not know.
  kSizeMismatch,       ///< FileHeader::byte_size is not the number of bytes (truncated or extended file).
  kBadReservedField,   ///< A field that must be zero is not zero.
  kSectionTableRange,  ///< The section table does not fit in the file.
  kSectionMisaligned,
  kSectionStride,  ///< A known section's stride is not its record's size.
  kSectionRange,   ///< offset + count * stride leaves the file (or overflows).
  kSectionOverlap,
  kDuplicateSection,
  kMissingSection,
  kUnknownRequiredSection,
  kGeometryCount,   ///< The geometry section's count is not the header's, or larger than a leaf can name.
  kPrimitiveCount,  ///< Header, geometry table and primitive map do not agree.
  // Whole content (validate).
  kBadChecksum,
  kBadReference,     ///< A node reference has an unknown type, or does not name a record of its section.
  kReferenceOrder,   ///< A child does not lie behind its parent: the tree could loop.
  kSharedNode,       ///< A node or leaf is reached more than once.
  kEmptyNode,        ///< A box node without children.
  kBadChildSlots,    ///< The children byte of a quantized node does not match its references, or names no axis.
  kBadGrid,          ///< The origin or the exponent of a quantized node is out of range.
  kInexactPlane,     ///< A plane of a quantized node is not exactly a float, or out of range.
  kUnreachable,      ///< A node or leaf is not reached.
  kBadBox,           ///< A used box is NaN, infinite or inverted, or an unused box is not empty.
  kBoxNotContained,  ///< The content of a child is not inside the box that its parent states.
  kBadBounds,        ///< The header's bounds are not the root's.
  kBadChildFlags,    ///< A child-flags byte does not match the content below the child.
  kUnterminatedRun,  ///< A run of leaves passes the end of the section.
  kBadVertex,        ///< A coordinate is NaN or infinite, or vertex 3 of a single triangle is not vertex 2.
  kBadGeometryId,    ///< The geometry does not exist, or is of the other kind (triangles, custom).
  kBadPrimitiveId,
  kBadTriangleId,         ///< The triangle-id byte names no rotation, or is not that of a custom primitive.
  kSplitWithoutFeature,   ///< A primitive is in several leaves, but the feature bit is not set.
  kSplitDiffers,          ///< The leaves of a split primitive have different triangles.
  kSplitNotCovered,       ///< The boxes of a split primitive's references do not cover it.
  kSplitCustom,           ///< A custom primitive is in several leaves.
  kPrimitiveMapMismatch,  ///< The map names a leaf without the primitive, or calls a primitive in a leaf dropped.
  kDroppedCount,
  kFeatureMismatch,  ///< A feature bit is missing, or set without need.
  kStackBound,       ///< The header's stack bound is too small for a traversal, or larger than any tree needs.
  kBadProvenance,    ///< The provenance is not a JSON object in UTF-8.
  // Instances and their objects.
  kBadLevels,          ///< The header's levels are not those of the instances.
  kBadTransformBound,  ///< The header's condition or reach is too small for the transforms, or not finite.
  kBadObject,          ///< An object lies outside its section, or its record does not match its file.
  kBadInstance,        ///< An instance has no object before its own, does not enter all of it once, or has no inverse.
  kInstanceLeaf,       ///< A leaf of instances is not alone in its run.
  kBadMotion,          ///< The keys of a motion are not in their section, not finite, not in order, or not invertible.
  kBadShape,           ///< A geometry's shapes are not in their section, not as many as its primitives, or not valid.
  kBadBoxMargin,       ///< The header's margin of boxes is not positive with kWidenedBoxes, or not 0 without.
};

/// Number of enumerators.
inline constexpr std::size_t kFormatErrors = static_cast<std::size_t>(FormatError::kBadBoxMargin) + 1;

/// @return the enumerator without its k, for example "BadMagic"; a string literal.
HIPRT_BUILD_API const char* name(FormatError error);

/// How the numbers of a FormatIssue are stored.
enum class NumberKind : std::uint32_t {
  kInteger,
  kFloat,   ///< The bits of a float, in the low 32 bits.
  kDouble,  ///< The bits of a double.
};

/// A fault: what is wrong, where, and the numbers that show it.
struct FormatIssue {
  FormatError error;
  std::uint64_t offset;  ///< Byte offset in the file of the wrong field.
  std::uint64_t value;   ///< What was found. For a plane that is not stored as a float: the float that it encodes.
  std::uint64_t limit;   ///< What was expected, or the largest or smallest allowed value; the error says which.
  NumberKind number = NumberKind::kInteger;  ///< Kind of value and limit.
};

/// One sentence that ends with the byte offset and the name of the error.
/// E.g. "210338 bytes, but its header says 420677: the file is truncated (byte 24, SizeMismatch)".
HIPRT_BUILD_API std::string to_string(const FormatIssue& issue);

}  // namespace hiprt
