#pragma once
/// The ways in which bytes can fail to be a BVH file. Host only.

#include <cstdint>
#include <string>

namespace hiprt {

enum class FormatError : std::uint32_t {
  // Header and section table (open_buffer).
  kMisaligned,            ///< The bytes do not start at a multiple of 128 in memory.
  kTooSmall,              ///< Shorter than the file header.
  kBadMagic,
  kUnknownMajorVersion,
  kUnknownLayout,
  kUnknownFeature,        ///< A feature bit this version does not know.
  kSizeMismatch,          ///< FileHeader::byte_size differs from the number of bytes given (truncated or extended file).
  kBadReservedField,      ///< A field that must be zero is not.
  kSectionTableRange,     ///< The section table does not fit in the file.
  kSectionMisaligned,
  kSectionStride,         ///< A known section's stride is not its record's size.
  kSectionRange,          ///< offset + count * stride leaves the file (or overflows).
  kSectionOverlap,
  kDuplicateSection,
  kMissingSection,
  kUnknownRequiredSection,
  kGeometryCount,         ///< The geometry section's count differs from the header, or exceeds what a leaf can name.
  kPrimitiveCount,        ///< Header, geometry table and primitive map disagree.
  // Whole content (validate).
  kBadChecksum,
  kBadReference,          ///< A node reference of an unknown type, out of its section or not on a record boundary.
  kReferenceOrder,        ///< A child does not lie behind its parent: the tree could loop.
  kSharedNode,            ///< A node or leaf is reached more than once.
  kUnreachable,           ///< A node or leaf is not reached.
  kBadBox,                ///< NaN, infinite or inverted box of a present child, or a non-empty box of an absent one.
  kBoxNotContained,       ///< A child's content leaves the box its parent states.
  kBadBounds,             ///< The header's bounds are not the root's.
  kUnterminatedRun,       ///< A run of leaves passes the end of the section.
  kBadVertex,             ///< NaN or infinite coordinate.
  kBadGeometryId,
  kBadPrimitiveId,
  kBadTriangleId,         ///< The triangle-id byte names no rotation.
  kSplitWithoutFeature,   ///< A primitive is in several leaves, but the feature bit is not set.
  kSplitNotCovered,       ///< The boxes of a split primitive's references do not cover it.
  kPrimitiveMapMismatch,  ///< The map names a leaf that does not hold the primitive, or calls a reachable one dropped.
  kDroppedCount,
  kStackBound,            ///< The header's stack bound is smaller than what a traversal can need.
  kBadProvenance,         ///< Not a JSON object in UTF-8.
};

/// @return the enumerator without its k, e.g. "BadMagic".
const char* name(FormatError error);

/// What is wrong, where, and the numbers that show it.
struct FormatIssue {
  FormatError error;
  std::uint64_t offset;  ///< Byte offset in the file of the field at fault.
  std::uint64_t value;   ///< What is there.
  std::uint64_t limit;   ///< What it is measured against.
};

/// One line: "BadReference at byte 1234: 77, limit 12".
inline std::string to_string(const FormatIssue& issue) {
  return std::string(name(issue.error)) + " at byte " + std::to_string(issue.offset) + ": found " +
         std::to_string(issue.value) + ", expected or limit " + std::to_string(issue.limit);
}

inline const char* name(FormatError error) {
  constexpr const char* kNames[] = {
      "Misaligned",       "TooSmall",          "BadMagic",         "UnknownMajorVersion", "UnknownLayout",
      "UnknownFeature",   "SizeMismatch",      "BadReservedField", "SectionTableRange",   "SectionMisaligned",
      "SectionStride",    "SectionRange",      "SectionOverlap",   "DuplicateSection",    "MissingSection",
      "UnknownRequiredSection", "GeometryCount", "PrimitiveCount", "BadChecksum",         "BadReference",
      "ReferenceOrder",   "SharedNode",        "Unreachable",      "BadBox",              "BoxNotContained",
      "BadBounds",        "UnterminatedRun",   "BadVertex",        "BadGeometryId",       "BadPrimitiveId",
      "BadTriangleId",    "SplitWithoutFeature", "SplitNotCovered", "PrimitiveMapMismatch", "DroppedCount",
      "StackBound",       "BadProvenance"};
  static_assert(sizeof(kNames) / sizeof(kNames[0]) == static_cast<std::size_t>(FormatError::kBadProvenance) + 1);
  return kNames[static_cast<std::size_t>(error)];
}

}  // namespace hiprt
