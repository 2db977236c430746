#include "bad_files.h"

#include <hiprt_build/format/dispatch_layout.h>
#include <utility>

namespace hiprt::test {

namespace {

std::vector<BadCase> header_cases() {
  using E = FormatError;
  return {
      {E::kBadMagic, "one wrong letter", row_header_with<char>(0, 'h')},
      {E::kUnknownMajorVersion, "version 2", row_header_with<std::uint16_t>(8, 2)},
      {E::kUnknownLayout, "layout 0", row_header_with(12, 0u)},
      {E::kUnknownLayout, "layout 5", row_header_with(12, 5u)},
      {E::kUnknownFeature, "bit 8", row_header_with<std::uint64_t>(16, 256 | 3)},
      {E::kSizeMismatch, "one byte more", row_header_with<std::uint64_t>(24, 1198)},
      {E::kBadReservedField, "header", row_header_with<std::uint64_t>(88 + 24, 1)},
      {E::kBadBoxMargin, "without widened boxes", row_header_with<float>(108, 1.0f)},
      {E::kSectionTableRange, "65 sections", row_header_with(40, 65u)},
      {E::kSectionTableRange, "2^32 - 1 sections", row_header_with(40, 0xffffffffu)},
      {E::kGeometryCount, "3 for 2", row_header_with(52, 3u)},
      {E::kPrimitiveCount, "header", row_header_with<std::uint64_t>(80, 9)},
      {E::kFeatureMismatch, "masks missing", row_header_with<std::uint64_t>(16, 1)},
      {E::kFeatureMismatch, "triangles missing", row_header_with<std::uint64_t>(16, 2)},
      {E::kFeatureMismatch, "custom in place of triangles", row_header_with<std::uint64_t>(16, 2 | 8)},
      {E::kFeatureMismatch, "custom without custom leaves", row_header_with<std::uint64_t>(16, 3 | 8)},
      {E::kFeatureMismatch, "triangles of an empty scene",
       [](NodeLayout layout) { return patched(empty_scene(layout), 16, std::uint64_t{1}); }},
      {E::kStackBound, "one less than needed", row_header_with(48, 1u)},
      {E::kStackBound, "more than any tree of two nodes needs", row_header_with(48, 7u)},
      {E::kBadChecksum, "one bit",
       [](NodeLayout layout) {
         BadFile bad{row_scene(layout).write(), 32};
         bad.file.put<std::uint64_t>(32, bad.file.get<std::uint64_t>(32) ^ 1);
         return bad;
       }},
  };
}

/// Field @p field of the section table's entry @p entry.
template <class T> std::function<BadFile(NodeLayout)> entry_with(std::uint64_t entry, std::uint64_t field, T value) {
  return row_header_with(TestScene::entry_at(entry) + field, value);
}

BadFile two_entries_of(NodeLayout layout, std::uint32_t kind, std::uint64_t at) {
  return patched(row_scene(layout), at, kind);
}

std::vector<BadCase> section_cases() {
  using E = FormatError;
  constexpr std::uint64_t kHuge = ~std::uint64_t{0};
  return {
      {E::kSectionMisaligned, "64", entry_with<std::uint64_t>(0, 8, 448)},
      {E::kSectionStride, "zero", entry_with<std::uint64_t>(1, 24, 0)},
      {E::kSectionStride, "32-byte leaves", entry_with<std::uint64_t>(1, 24, 32)},
      {E::kSectionStride, "nodes of another layout",
       [](NodeLayout layout) {
         return patched(row_scene(layout), TestScene::entry_at(0) + 24, 192 - row_scene(layout).node_size());
       }},
      {E::kSectionRange, "offset behind the end", entry_with<std::uint64_t>(2, 8, 1280)},
      {E::kSectionRange, "offset near 2^64", entry_with<std::uint64_t>(2, 8, kHuge - 127)},
      {E::kSectionRange, "count too large", entry_with<std::uint64_t>(4, 16, 1000)},
      {E::kSectionRange, "count * stride overflows", entry_with<std::uint64_t>(1, 16, std::uint64_t{1} << 58)},
      {E::kSectionOverlap, "leaves on nodes", entry_with<std::uint64_t>(1, 8, 384)},
      {E::kSectionOverlap, "nodes on the section table", entry_with<std::uint64_t>(0, 8, 128)},
      {E::kSectionOverlap, "nodes on the header", entry_with<std::uint64_t>(0, 8, 0)},
      {E::kDuplicateSection, "two leaf sections",
       [](NodeLayout layout) {
         TestScene scene = row_scene(layout);
         BadFile bad{scene.write(), TestScene::entry_at(4)};
         bad.file.put(TestScene::entry_at(4), SectionEntry{2, 0, scene.provenance_at(), 0, 64});
         bad.file.seal();
         return bad;
       }},
      {E::kMissingSection, "no map",
       [](NodeLayout layout) {
         BadFile bad = two_entries_of(layout, 77, TestScene::entry_at(2));
         bad.file.put(TestScene::entry_at(2) + 4, 0u);
         bad.file.seal();
         return BadFile{bad.file, 40};
       }},
      {E::kUnknownRequiredSection, "kind 77", entry_with(2, 0, 77u)},
  };
}

std::vector<BadCase> padding_and_provenance_cases() {
  using E = FormatError;
  return {
      {E::kBadReservedField, "between sections", row_header_with<std::uint8_t>(383, 1)},
      {E::kBadReservedField, "behind the last section",
       [](NodeLayout layout) {
         BadFile bad = patched(row_scene(layout), TestScene::entry_at(4) + 16, std::uint64_t{3});
         return BadFile{bad.file, row_scene(layout).provenance_at() + 3};
       }},
      {E::kBadProvenance, "not an object", row_with([](const TestScene& s) { return s.provenance_at(); }, '[')},
      {E::kBadProvenance, "not closed", row_with([](const TestScene& s) { return s.end() - 1; }, '{')},
      {E::kBadProvenance, "stray continuation byte",
       row_with([](const TestScene& s) { return s.provenance_at() + 3; }, '\x80')},
      {E::kBadProvenance, "empty",
       [](NodeLayout layout) {
         TestScene scene = row_scene(layout);
         scene.provenance = " ";
         BadFile bad = patched(scene, TestScene::entry_at(4) + 16, std::uint64_t{0});
         bad.file.put(scene.provenance_at(), '\0');
         bad.file.seal();
         return BadFile{bad.file, scene.provenance_at()};
       }},
  };
}

std::vector<BadCase> geometry_cases() {
  using E = FormatError;
  const auto geometry = [](unsigned i, unsigned field) {
    return [=](const TestScene& scene) { return scene.geometries_at() + 32 * i + field; };
  };
  return {
      {E::kPrimitiveCount, "gap in the numbering", row_with<std::uint64_t>(geometry(1, 0), 7)},
      {E::kPrimitiveCount, "more than the header's", row_with<std::uint64_t>(geometry(1, 8), 3)},
      {E::kPrimitiveCount, "overflow", row_with<std::uint64_t>(geometry(1, 8), ~std::uint64_t{0})},
      {E::kPrimitiveCount, "too few in the table",
       [](NodeLayout layout) {
         const TestScene scene = row_scene(layout);
         return BadFile{patched(scene, scene.geometries_at() + 32 + 8, std::uint64_t{1}).file, 80};
       }},
      {E::kBadReservedField, "geometry flags", row_with(geometry(1, 28), 2u)},
      {E::kBadReservedField, "the highest flag of a mesh below its type", row_with(geometry(1, 28), 0x80u)},
      {E::kBadReservedField, "custom geometry flags", row_with(geometry(1, 28), 0x11u)},
      {E::kDroppedCount, "none instead of one", row_with<std::uint64_t>(geometry(0, 16), 0)},
      {E::kDroppedCount, "one instead of none", row_with<std::uint64_t>(geometry(1, 16), 1)},
      {E::kPrimitiveMapMismatch, "another leaf", row_with([](const TestScene& s) { return s.map_at(); }, 2u)},
      {E::kPrimitiveMapMismatch, "the leaf's other triangle",
       row_with([](const TestScene& s) { return s.map_at(); }, 1u)},
      {E::kPrimitiveMapMismatch, "no leaf", row_with([](const TestScene& s) { return s.map_at() + 28; }, 1000000u)},
      {E::kPrimitiveMapMismatch, "reachable called dropped",
       row_with([](const TestScene& s) { return s.map_at() + 4; }, kInvalidId)},
      {E::kPrimitiveMapMismatch, "dropped called reachable",
       row_with([](const TestScene& s) { return s.map_at() + 16; }, 0u)},
  };
}

}  // namespace

std::vector<BadCase> container_cases() {
  std::vector<BadCase> all;
  for (auto* part : {header_cases, section_cases, padding_and_provenance_cases, geometry_cases})
    for (BadCase& bad : part()) all.push_back(std::move(bad));
  return all;
}

}  // namespace hiprt::test
