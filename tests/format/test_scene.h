#pragma once
/// Small BVH files assembled by hand: the oracle of the format tests, independent of hiprt_build's encoder.

#include <hiprt_device/format/buffer.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <vector>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace hiprt::test {

inline constexpr float kInf = std::numeric_limits<float>::infinity();
inline constexpr Box kEmpty{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}};

/// A copy of bytes in memory aligned as a BVH file must be.
class TestFile {
 public:
  explicit TestFile(std::span<const std::byte> bytes) : blocks_(bytes.size() / kBlock + 2), size_(bytes.size()) {
    if (!bytes.empty()) std::memcpy(data(), bytes.data(), bytes.size());
  }

  std::byte* data() { return blocks_.data()->bytes; }
  const std::byte* data() const { return blocks_.data()->bytes; }
  std::size_t size() const { return size_; }
  std::span<const std::byte> bytes() const { return {data(), size_}; }

  template <class T> T get(std::uint64_t offset) const {
    T value;
    std::memcpy(&value, data() + offset, sizeof(T));
    return value;
  }
  template <class T> void put(std::uint64_t offset, T value) { std::memcpy(data() + offset, &value, sizeof(T)); }

  /// seal(), if the file is long enough to have a header.
  void seal_if_possible() {
    if (size_ >= sizeof(FileHeader)) seal();
  }
  /// Makes byte_size and checksum right again, by XXH3's one-shot function (the library uses its streaming functions).
  void seal() {
    put<std::uint64_t>(24, size_);
    std::vector<std::byte> covered(data(), data() + 32);
    covered.insert(covered.end(), data() + 40, data() + size_);
    put<std::uint64_t>(32, XXH3_64bits(covered.data(), covered.size()));
  }

 private:
  static constexpr std::size_t kBlock = 256;
  struct alignas(kBlock) Block {
    std::byte bytes[kBlock];
  };
  std::vector<Block> blocks_;
  std::size_t size_;
};

enum class ChildKind { kAbsent, kNode, kLeaves };
struct TestChild {
  ChildKind kind = ChildKind::kAbsent;
  std::uint32_t index = 0;  ///< Of the node or of the first leaf.
  Box box = kEmpty;
  std::uint32_t flags = 0;
};
inline TestChild child_node(std::uint32_t index, const Box& box) { return {ChildKind::kNode, index, box, 5}; }
inline TestChild child_leaves(std::uint32_t index, const Box& box) { return {ChildKind::kLeaves, index, box, 5}; }

struct TestLeaf {
  std::array<std::array<float, 3>, 4> vertex{};
  std::array<std::uint32_t, 2> primitive{};
  std::uint32_t geometry = 0;
  bool last = true;
  std::array<std::uint8_t, 2> id{0x89, 0x89};
};

/// What a file holds, free of layout and offsets. Sections are written in the order nodes, leaves, map, geometries,
/// provenance.
struct TestScene {
  NodeLayout layout = NodeLayout::kFloat;
  TestChild root{};
  std::uint32_t stack_bound = 0;
  std::uint64_t features = 1;
  std::vector<std::array<TestChild, 4>> nodes;
  std::vector<TestLeaf> leaves;
  std::vector<std::uint32_t> map;
  std::vector<GeometryRecord> geometries;
  std::string provenance;  ///< No section if empty.

  static constexpr std::uint64_t kNodesAt = 384;
  static std::uint64_t round_up(std::uint64_t offset) { return (offset + 127) / 128 * 128; }
  std::uint64_t node_at(std::uint64_t i) const { return kNodesAt + 128 * i; }
  std::uint64_t leaf_at(std::uint64_t i) const { return node_at(nodes.size()) + 64 * i; }
  std::uint64_t map_at() const { return round_up(leaf_at(leaves.size())); }
  std::uint64_t geometries_at() const { return round_up(map_at() + 4 * map.size()); }
  std::uint64_t provenance_at() const { return round_up(geometries_at() + 32 * geometries.size()); }
  std::uint64_t end() const {
    return provenance.empty() ? geometries_at() + 32 * geometries.size() : provenance_at() + provenance.size();
  }
  /// Where the section table's entry i is (i = kind - 1).
  static std::uint64_t entry_at(std::uint64_t i) { return 128 + 32 * i; }
  /// Where a child's plane is; side 0 = min.
  std::uint64_t plane_at(std::uint64_t node, unsigned child, unsigned side, unsigned axis) const {
    return node_at(node) + 16 +
           (layout == NodeLayout::kFloat ? 24 * child + 12 * side + 4 * axis : 32 * axis + 16 * side + 4 * child);
  }
  std::uint64_t vertex_at(std::uint64_t leaf, unsigned vertex, unsigned axis) const {
    return leaf_at(leaf) + (layout == NodeLayout::kFloat ? 12 * vertex + 4 * axis : 16 * axis + 4 * vertex);
  }
  std::uint32_t reference(const TestChild& child) const {
    if (child.kind == ChildKind::kAbsent) return 0xffffffffu;
    const bool node = child.kind == ChildKind::kNode;
    return static_cast<std::uint32_t>((node ? node_at(child.index) : leaf_at(child.index)) / 64 * 8 + (node ? 5 : 0));
  }

  TestFile write() const {
    TestFile file{std::vector<std::byte>(end())};
    write_header(file);
    for (std::size_t i = 0; i < nodes.size(); ++i) write_node(file, i);
    for (std::size_t i = 0; i < leaves.size(); ++i) write_leaf(file, i);
    for (std::size_t i = 0; i < map.size(); ++i) file.put(map_at() + 4 * i, map[i]);
    for (std::size_t i = 0; i < geometries.size(); ++i) file.put(geometries_at() + 32 * i, geometries[i]);
    if (!provenance.empty()) std::memcpy(file.data() + provenance_at(), provenance.data(), provenance.size());
    file.seal();
    return file;
  }

 private:
  void write_header(TestFile& file) const {
    std::memcpy(file.data(), "HIPRTBVH", 8);
    file.put<std::uint16_t>(8, 1);
    file.put<std::uint32_t>(12, static_cast<std::uint32_t>(layout));
    file.put(16, features);
    const std::uint32_t sections = provenance.empty() ? 4 : 5;
    file.put(40, sections);
    file.put(44, reference(root));
    file.put(48, stack_bound);
    file.put(52, static_cast<std::uint32_t>(geometries.size()));
    file.put(56, root.box);
    file.put<std::uint64_t>(80, map.size());
    const std::uint64_t offsets[] = {kNodesAt, leaf_at(0), map_at(), geometries_at(), provenance_at()};
    const std::uint64_t counts[] = {nodes.size(), leaves.size(), map.size(), geometries.size(), provenance.size()};
    const std::uint64_t strides[] = {128, 64, 4, 32, 1};
    for (std::uint32_t i = 0; i < sections; ++i)
      file.put(entry_at(i), SectionEntry{i + 1, i < 4 ? 1u : 0u, offsets[i], counts[i], strides[i]});
  }

  void write_node(TestFile& file, std::size_t i) const {
    for (unsigned c = 0; c < 4; ++c) {
      const TestChild& child = nodes[i][c];
      file.put(node_at(i) + 4 * c, reference(child));
      for (unsigned axis = 0; axis < 3; ++axis) {
        file.put(plane_at(i, c, 0, axis), child.box.min[axis]);
        file.put(plane_at(i, c, 1, axis), child.box.max[axis]);
      }
      file.put(node_at(i) + 112 + c, static_cast<std::uint8_t>(child.flags));
    }
  }

  void write_leaf(TestFile& file, std::size_t i) const {
    const TestLeaf& leaf = leaves[i];
    for (unsigned v = 0; v < 4; ++v)
      for (unsigned axis = 0; axis < 3; ++axis) file.put(vertex_at(i, v, axis), leaf.vertex[v][axis]);
    file.put(leaf_at(i) + 48, leaf.primitive);
    file.put(leaf_at(i) + 56, leaf.geometry | (leaf.last ? 0x80000000u : 0u));
    file.put(leaf_at(i) + 60, leaf.id);
  }
};

/// The box of the squares @p first to @p last of row_scene().
inline Box row_box(unsigned first, unsigned last) {
  return {{2.0f * static_cast<float>(first), 0, 0}, {2.0f * static_cast<float>(last) + 1, 1, 0}};
}

inline TestLeaf row_leaf(unsigned i) {
  const float x = 2.0f * static_cast<float>(i);
  return {.vertex = {{{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}, {x + 1, 1, 0}}}};
}

/// The scene of the golden files: see golden/make_golden.py.
inline TestScene row_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  scene.root = child_node(0, row_box(0, 3));
  scene.stack_bound = 2;
  scene.features = 3;
  scene.nodes = {{child_leaves(0, row_box(0, 1)), {}, child_node(1, row_box(2, 3)), {}},
                 {TestChild{}, child_leaves(2, row_box(2, 2)), {}, child_leaves(3, row_box(3, 3))}};
  scene.leaves = {row_leaf(0), row_leaf(1), row_leaf(2), row_leaf(3)};
  scene.leaves[0].primitive = {0, 1};
  scene.leaves[0].last = false;
  scene.leaves[1].primitive = {2, 3};
  scene.leaves[2].primitive = {5, 0xffffffffu};
  scene.leaves[2].vertex[3] = scene.leaves[2].vertex[2];
  scene.leaves[2].id = {0x89, 0};
  scene.leaves[3].primitive = {1, 0};
  scene.leaves[3].geometry = 1;
  scene.leaves[3].id = {0x84, 0x82};
  scene.map = {0, 1, 2, 3, 0xffffffffu, 4, 7, 6};
  scene.geometries = {{0, 6, 1, 0xffffffffu, 0}, {6, 2, 0, 2, 0}};
  scene.provenance =
      "{\"tool\": \"make_golden.py\", \"note\": \"gr\xc3\xbc\xc3\x9f"
      "e\"}";
  return scene;
}

/// One triangle (0,0,0) (4,0,0) (0,4,0) split at x = 2 into two leaves; the second copy is stored rotated by 1.
inline TestScene split_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  const Box left{{0, 0, 0}, {2, 4, 0}}, right{{2, 0, 0}, {4, 2, 0}};
  scene.root = child_node(0, {{0, 0, 0}, {4, 4, 0}});
  scene.stack_bound = 1;
  scene.features = 5;
  scene.nodes = {{child_leaves(0, left), child_leaves(1, right), {}, {}}};
  scene.leaves = {
      {.vertex = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 4, 0}}}, .primitive = {0, 0xffffffffu}, .id = {0x89, 0}},
      {.vertex = {{{4, 0, 0}, {0, 4, 0}, {0, 0, 0}, {0, 0, 0}}}, .primitive = {0, 0xffffffffu}, .id = {0x84, 0}}};
  scene.map = {0};
  scene.geometries = {{0, 1, 0, 0xffffffffu, 0}};
  return scene;
}

/// One leaf and no box node.
inline TestScene root_leaf_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  scene.root = child_leaves(0, row_box(0, 0));
  scene.leaves = {row_leaf(0)};
  scene.leaves[0].primitive = {0, 1};
  scene.map = {0, 1};
  scene.geometries = {{0, 2, 0, 0xffffffffu, 0}};
  return scene;
}

/// One geometry whose only triangle is dropped.
inline TestScene empty_scene(NodeLayout layout) {
  TestScene scene;
  scene.layout = layout;
  scene.features = 0;
  scene.map = {0xffffffffu};
  scene.geometries = {{0, 1, 1, 0xffffffffu, 0}};
  return scene;
}

}  // namespace hiprt::test
