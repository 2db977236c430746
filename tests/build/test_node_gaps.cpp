// Gaps between nodes of layout planes: where they are, that nothing else changes, and that wrong ones are refused.

#include <hiprt_build/file.h>
#include <hiprt_build/format/checksum.h>
#include <tests/build/refit_file.h>
#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <array>
#include <bit>
#include <cstring>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::test;

namespace {

/// Offsets of nodes by walking, from FORMAT_NODES.md alone.
std::vector<std::uint64_t> walked(std::uint64_t nodes, std::uint64_t size, bool gaps) {
  std::vector<std::uint64_t> offsets;
  std::uint64_t at = 0;
  for (std::uint64_t i = 0; i < nodes; ++i, at += size) {
    if (gaps && i != 0 && i % 64 == 0) at += 64;
    offsets.push_back(at);
  }
  return offsets;
}

using Bits = std::array<std::uint32_t, 6>;

File in_planes(const Mesh& mesh) {
  return built(mesh, {.builder = build::Builder::kSah, .nodes = NodeLayout::kPlanes, .max_leaf_triangles = 2});
}

/// The file after a change of its bytes, with a checksum that fits.
template <class Change> std::optional<FormatIssue> fault_of(File& file, Change&& change) {
  const std::string before = file.copy();
  change(file.bytes());
  reinterpret_cast<FileHeader*>(file.bytes().data())->checksum = file_checksum(file.bytes());
  const auto valid = validate(file.bytes());
  std::memcpy(file.bytes().data(), before.data(), before.size());
  return valid ? std::nullopt : std::optional(valid.error());
}

SectionEntry& node_entry(std::span<std::byte> bytes) {
  auto* entry = reinterpret_cast<SectionEntry*>(bytes.data() + sizeof(FileHeader));
  while (entry->kind != static_cast<std::uint32_t>(SectionKind::kNodes)) ++entry;
  return *entry;
}

}  // namespace

TEST_CASE("nodes have gaps of 64 bytes after every 64") {
  for (const std::uint64_t size : {64u, 128u})
    for (const bool gaps : {false, true})
      for (const std::uint64_t nodes : {0u, 1u, 63u, 64u, 65u, 128u, 129u, 1000u}) {
        if (size == 64 && gaps) continue;
        CAPTURE(size, gaps, nodes);
        const NodePlaces places(size, gaps);
        const std::vector<std::uint64_t> offsets = walked(nodes, size, gaps);
        std::uint64_t found = 0;
        for (std::uint64_t i = 0; i < nodes; ++i) {
          CHECK(places.offset(i) == offsets[i]);
          CHECK(places.number(offsets[i]) == i);
          CHECK(places.number(offsets[i] + size - 1) == i);
        }
        const std::uint64_t end = nodes == 0 ? 0 : offsets.back() + size;
        for (std::uint64_t at = 0; at < end + 4 * size; at += 16)
          if (places.is_node(at, nodes)) CHECK(at == offsets[found++]);
        CHECK(found == nodes);
        const SectionEntry entry{1, 1, 384, places.count(nodes), places.stride(nodes)};
        CHECK(entry.count * entry.stride == end);
        CHECK(entry.stride == (gaps && nodes > 64 ? 64 : size));
        CHECK(places.nodes(entry) == nodes);
      }
}

TEST_CASE("trees with gaps are those of layout float") {
  const std::vector<Mesh> meshes{identical(40), icosphere(2), soup(400, 0.1, 1), soup(3000, 0.2, 2)};
  bool gaps = false, none = false;
  for (const Mesh& mesh : meshes) {
    File planes = in_planes(mesh),
         floats = built(mesh, {.builder = build::Builder::kSah, .nodes = NodeLayout::kFloat, .max_leaf_triangles = 2});
    const BufferView view = planes.view(), other = floats.view();
    check_valid(planes.bytes());
    REQUIRE(view.node_count() == other.node_count());
    CHECK(view.nodes.stride == (view.node_count() > 64 ? 64 : 128));
    (view.node_count() > 64 ? gaps : none) = true;
    const std::vector<std::uint64_t> offsets = walked(view.node_count(), 128, true);
    const auto nodes = view.node_array<PlanesBoxNode>();
    const auto expected = other.records<FloatBoxNode>(other.nodes);
    for (std::uint64_t i = 0; i < view.node_count(); ++i) {
      CHECK(reinterpret_cast<const std::byte*>(&nodes[i]) == view.bytes.data() + view.nodes.offset + offsets[i]);
      for (unsigned c = 0; c < kBranching; ++c) {
        const Box box = PlanesLayout::box(nodes[i], c);
        CHECK(std::bit_cast<Bits>(box) == std::bit_cast<Bits>(expected[i].box[c]));
        const NodeRef ref = nodes[i].child[c], there = expected[i].child[c];
        CHECK((ref == kInvalidRef) == (there == kInvalidRef));
        if (ref == kInvalidRef) continue;
        REQUIRE(ref_type(ref) == ref_type(there));
        if (is_box(ref))
          CHECK(ref_offset(ref) == view.nodes.offset + offsets[other.node_number(there)]);
        else
          CHECK(ref_offset(ref) - view.leaves.offset == ref_offset(there) - other.leaves.offset);
      }
    }
  }
  CHECK(gaps);
  CHECK(none);
}

TEST_CASE("wrong gaps are refused") {
  File file = in_planes(soup(3000, 0.2, 3));
  const BufferView view = file.view();
  REQUIRE(view.node_count() > 128);
  const std::uint64_t first = view.nodes.offset, gap = first + 64 * 128;
  const auto expect = [&](FormatError error, auto&& change) {
    const auto fault = fault_of(file, change);
    REQUIRE(fault.has_value());
    INFO(to_string(*fault));
    CHECK(fault->error == error);
    return *fault;
  };
  expect(FormatError::kSectionStride, [](auto bytes) { node_entry(bytes).stride = 32; });
  // A section that ends with a gap, or with half a node.
  expect(FormatError::kSectionRange, [&](auto bytes) { node_entry(bytes).count -= node_entry(bytes).count % 129; });
  expect(FormatError::kSectionRange, [&](auto bytes) { node_entry(bytes).count -= node_entry(bytes).count % 129 - 1; });
  // No more nodes than a block has.
  expect(FormatError::kSectionStride, [&](auto bytes) { node_entry(bytes).count = 128; });
  const FormatIssue padding =
      expect(FormatError::kBadReservedField, [&](auto bytes) { bytes[gap + 63] = std::byte{1}; });
  CHECK(padding.offset == gap + 63);
  const std::uint64_t root = offsetof(FileHeader, root);
  for (const std::uint64_t at : {gap, first + 64, gap + 128})
    expect(FormatError::kBadReference, [&](auto bytes) {
      const NodeRef ref = make_ref(at, NodeType::kBox32);
      std::memcpy(bytes.data() + root, &ref, sizeof(ref));
    });
}
