#pragma once
/// The offsets of a file's sections. Every writer computes them here.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/format/node_places.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/layout.h>

#include <cstddef>
#include <cstdint>

namespace hiprt {

/// @param alignment more than 0.
constexpr std::uint64_t align_up(std::uint64_t offset, std::uint64_t alignment) {
  return (offset + alignment - 1) / alignment * alignment;
}

/// The sections of a file, one after the other.
class FileLayout {
 public:
  /// Bytes of the header and of a section table.
  static constexpr std::uint64_t head_size(std::uint32_t sections) {
    return sizeof(FileHeader) + std::uint64_t{sections} * sizeof(SectionEntry);
  }

  FileLayout() = default;
  /// @param sections number of entries that the table will have, up to kMaxSections.
  explicit FileLayout(std::uint32_t sections) : byte_size_(head_size(sections)) {}

  /// Appends a section.
  /// @param alignment of its offset.
  /// @return its offset.
  std::uint64_t add(SectionKind kind, std::uint64_t count, std::uint64_t stride, std::uint32_t flags = kSectionRequired,
                    std::uint64_t alignment = kSectionAlignment) {
    const std::uint64_t offset = align_up(byte_size_, alignment);
    sections_[count_++] = SectionEntry{static_cast<std::uint32_t>(kind), flags, offset, count, stride};
    byte_size_ = offset + count * stride;
    return offset;
  }
  /// Appends section kNodes.
  void add_nodes(NodeLayout layout, std::uint64_t nodes) {
    const NodePlaces places(node_size(layout), NodePlaces::has_gaps(layout));
    add(SectionKind::kNodes, places.count(nodes), places.stride(nodes));
  }
  /// Appends a section with the offset that it has.
  /// @param end of the file so far.
  void keep(const SectionEntry& section, std::uint64_t end) {
    sections_[count_++] = section;
    byte_size_ = end;
  }

  /// Sections in the order in which they were added.
  const SectionEntry& operator[](std::uint32_t i) const { return sections_[i]; }
  SectionEntry& operator[](std::uint32_t i) { return sections_[i]; }
  const SectionEntry* begin() const { return sections_; }
  const SectionEntry* end() const { return sections_ + count_; }
  SectionEntry* begin() { return sections_; }
  SectionEntry* end() { return sections_ + count_; }
  std::uint32_t count() const { return count_; }
  /// Size of the whole file.
  std::uint64_t byte_size() const { return byte_size_; }

 private:
  SectionEntry sections_[kMaxSections]{};
  std::uint32_t count_ = 0;
  std::uint64_t byte_size_ = 0;
};

/// Numbers of records in the sections that every file has.
struct FileCounts {
  std::uint64_t nodes, leaves, primitives = 0, geometries = 0;
  std::uint64_t provenance = 0;  ///< Bytes.
};

/// Positions in tree_layout().
enum TreeSection : std::uint32_t { kNodesAt, kLeavesAt, kPrimitiveMapAt, kGeometriesAt, kProvenanceAt, kTreeSections };

/// The sections that every file has: kTreeSections of them.
/// @param more sections that will be appended.
inline FileLayout tree_layout(NodeLayout layout, const FileCounts& counts, std::uint32_t more = 0) {
  FileLayout file(kTreeSections + more);
  file.add_nodes(layout, counts.nodes);
  file.add(SectionKind::kLeaves, counts.leaves, sizeof(FloatLeaf));
  file.add(SectionKind::kPrimitiveMap, counts.primitives, sizeof(std::uint32_t));
  file.add(SectionKind::kGeometries, counts.geometries, sizeof(GeometryRecord));
  file.add(SectionKind::kProvenance, counts.provenance, 1, 0);
  return file;
}

}  // namespace hiprt
