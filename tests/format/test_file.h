#pragma once
/// Small BVH files assembled by hand, independent of the encoder in hiprt_build.

#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_device/format/buffer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
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
  /// Not inline: GCC 12 warns of writes that cannot happen.
  template <class T> [[gnu::noinline]] void put(std::uint64_t offset, T value) {
    std::memcpy(data() + offset, &value, sizeof(T));
  }

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

/// The bits of a half whose value is exactly @p value. Throws std::logic_error if there is none.
inline std::uint16_t exact_half(float value) {
  if (value != value) return 0x7e00;
  const unsigned sign = std::signbit(value) ? 0x8000u : 0u;
  const double magnitude = std::abs(static_cast<double>(value));
  if (std::isinf(value)) return static_cast<std::uint16_t>(sign | 0x7c00u);
  for (unsigned bits = 0; bits < 0x7c00; ++bits) {
    const int exponent = static_cast<int>(bits >> 10);
    const double candidate = exponent == 0 ? std::ldexp(bits, -24) : std::ldexp(1024 + (bits & 1023u), exponent - 25);
    if (candidate == magnitude) return static_cast<std::uint16_t>(sign | bits);
  }
  throw std::logic_error("not a half");
}

enum class ChildKind { kAbsent, kNode, kLeaves, kCustomLeaves };
struct TestChild {
  ChildKind kind = ChildKind::kAbsent;
  std::uint32_t index = 0;  ///< Of the node or of the first leaf.
  Box box = kEmpty;
  std::uint32_t flags = 0;  ///< Not written in layout half.
};
inline TestChild child_node(std::uint32_t index, const Box& box, std::uint32_t flags = 5) {
  return {ChildKind::kNode, index, box, flags};
}
inline TestChild child_leaves(std::uint32_t index, const Box& box) { return {ChildKind::kLeaves, index, box, 5}; }
inline TestChild child_customs(std::uint32_t index, const Box& box) {
  return {ChildKind::kCustomLeaves, index, box, 9};
}

struct TestLeaf {
  std::array<std::array<float, 3>, 4> vertex{};  ///< Of a triangle leaf.
  std::array<std::uint32_t, 2> primitive{};
  std::uint32_t geometry = 0;
  bool last = true;
  std::array<std::uint8_t, 2> id{0x89, 0x89};
  bool custom = false;
  std::array<Box, 2> box{kEmpty, kEmpty};  ///< Of a custom leaf.
};

/// The content of a file, without layout and offsets. Sections are written in the order nodes, leaves, map, geometries,
/// provenance. Layout half can hold boxes of halves only; quantized only boxes on multiples of 1/8 (x, z) and 1/16 (y),
/// less than 8 above the node's lowest plane.
struct TestScene {
  NodeLayout layout = NodeLayout::kFloat;
  std::uint16_t version_minor = 1;
  TestChild root{};
  std::uint32_t stack_bound = 0;
  std::uint64_t features = 1;
  std::vector<std::array<TestChild, 4>> nodes;
  std::vector<TestLeaf> leaves;
  std::vector<std::uint32_t> map;
  std::vector<GeometryRecord> geometries;
  std::string provenance;  ///< No section if empty.

  static constexpr std::uint64_t kNodesAt = 384;
  static constexpr std::uint8_t kExponent[3] = {124, 123, 124};  ///< Quantized: scales 1/8, 1/16, 1/8.
  static std::uint64_t round_up(std::uint64_t offset) { return (offset + 127) / 128 * 128; }
  bool is(NodeLayout wanted) const { return layout == wanted; }
  std::uint64_t node_size() const { return is(NodeLayout::kFloat) || is(NodeLayout::kPlanes) ? 128 : 64; }
  bool float_leaves() const { return is(NodeLayout::kFloat) || is(NodeLayout::kHalf); }
  std::uint32_t box_type() const { return is(NodeLayout::kHalf) ? 4 : 5; }
  std::uint64_t node_at(std::uint64_t i) const { return kNodesAt + node_size() * i; }
  std::uint64_t leaf_at(std::uint64_t i) const { return round_up(node_at(nodes.size())) + 64 * i; }
  std::uint64_t map_at() const { return round_up(leaf_at(leaves.size())); }
  std::uint64_t geometries_at() const { return round_up(map_at() + 4 * map.size()); }
  std::uint64_t provenance_at() const { return round_up(geometries_at() + 32 * geometries.size()); }
  std::uint64_t end() const {
    return provenance.empty() ? geometries_at() + 32 * geometries.size() : provenance_at() + provenance.size();
  }
  /// Where the section table's entry i is (i = kind - 1).
  static std::uint64_t entry_at(std::uint64_t i) { return 128 + 32 * i; }
  std::uint64_t child_at(std::uint64_t node, unsigned child) const {
    return node_at(node) + (is(NodeLayout::kQuantized) ? 16 : 0) + 4 * child;
  }
  /// @pre not layout half.
  std::uint64_t flags_at(std::uint64_t node, unsigned child) const {
    return node_at(node) + (is(NodeLayout::kQuantized) ? 56 : 112) + child;
  }
  /// Where a child's plane is; side 0 = min.
  std::uint64_t plane_at(std::uint64_t node, unsigned child, unsigned side, unsigned axis) const {
    switch (layout) {
      case NodeLayout::kFloat:
        return node_at(node) + 16 + 24 * child + 12 * side + 4 * axis;
      case NodeLayout::kPlanes:
        return node_at(node) + 16 + 32 * axis + 16 * side + 4 * child;
      case NodeLayout::kHalf:
        return node_at(node) + 16 + 12 * child + 6 * side + 2 * axis;
      case NodeLayout::kQuantized:
        return node_at(node) + 32 + 8 * axis + 4 * side + child;
    }
    throw std::logic_error("layout");
  }
  std::uint64_t vertex_at(std::uint64_t leaf, unsigned vertex, unsigned axis) const {
    return leaf_at(leaf) + (float_leaves() ? 12 * vertex + 4 * axis : 16 * axis + 4 * vertex);
  }
  /// Where a plane of a custom primitive's box is.
  std::uint64_t custom_plane_at(std::uint64_t leaf, unsigned which, unsigned side, unsigned axis) const {
    return leaf_at(leaf) + 24 * which + 12 * side + 4 * axis;
  }
  static std::uint32_t make_reference(std::uint64_t offset, std::uint32_t type) {
    return static_cast<std::uint32_t>(offset / 64 * 8 + type);
  }
  std::uint32_t reference(const TestChild& child) const {
    switch (child.kind) {
      case ChildKind::kNode:
        return make_reference(node_at(child.index), box_type());
      case ChildKind::kLeaves:
        return make_reference(leaf_at(child.index), 0);
      case ChildKind::kCustomLeaves:
        return make_reference(leaf_at(child.index), 7);
      case ChildKind::kAbsent:
        break;
    }
    return 0xffffffffu;
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
    file.put(10, version_minor);
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
    const std::uint64_t strides[] = {node_size(), 64, 4, 32, 1};
    for (std::uint32_t i = 0; i < sections; ++i)
      file.put(entry_at(i), SectionEntry{i + 1, i < 4 ? 1u : 0u, offsets[i], counts[i], strides[i]});
  }

  void write_node(TestFile& file, std::size_t i) const {
    for (unsigned c = 0; c < 4; ++c) {
      const TestChild& child = nodes[i][c];
      file.put(child_at(i, c), reference(child));
      if (!is(NodeLayout::kHalf)) file.put(flags_at(i, c), static_cast<std::uint8_t>(child.flags));
      for (unsigned side = 0; side < 2; ++side)
        for (unsigned axis = 0; axis < 3; ++axis)
          write_plane(file, i, c, side, axis, side == 0 ? child.box.min[axis] : child.box.max[axis]);
    }
    if (!is(NodeLayout::kQuantized)) return;
    std::uint8_t present = 0;
    for (unsigned c = 0; c < 4; ++c)
      if (nodes[i][c].kind != ChildKind::kAbsent) present = static_cast<std::uint8_t>(present | 1u << c);
    for (unsigned axis = 0; axis < 3; ++axis) {
      file.put(node_at(i) + 4 * axis, origin(i, axis));
      file.put(node_at(i) + 12 + axis, kExponent[axis]);
    }
    file.put(node_at(i) + 15, present);
  }

  void write_plane(TestFile& file, std::size_t i, unsigned c, unsigned side, unsigned axis, float value) const {
    const std::uint64_t at = plane_at(i, c, side, axis);
    if (is(NodeLayout::kHalf)) {
      file.put(at, exact_half(value));
    } else if (!is(NodeLayout::kQuantized)) {
      file.put(at, value);
    } else if (nodes[i][c].kind == ChildKind::kAbsent) {
      file.put<std::uint8_t>(at, side == 0 ? 255 : 0);
    } else {
      const double q =
          std::ldexp(static_cast<double>(value) - static_cast<double>(origin(i, axis)), 127 - kExponent[axis]);
      if (!(q >= 0 && q <= 255 && q == std::floor(q))) throw std::logic_error("plane is not on the grid");
      file.put(at, static_cast<std::uint8_t>(q));
    }
  }

  /// One below the node's lowest plane, so that byte 0 is not the lowest plane.
  float origin(std::size_t i, unsigned axis) const {
    float lowest = kInf;
    for (const TestChild& child : nodes[i]) lowest = std::min(lowest, child.box.min[axis]);
    return lowest == kInf ? 0.0f : std::floor(lowest) - 1;
  }

  void write_leaf(TestFile& file, std::size_t i) const {
    const TestLeaf& leaf = leaves[i];
    if (leaf.custom) {
      file.put(leaf_at(i), leaf.box);
    } else {
      for (unsigned v = 0; v < 4; ++v)
        for (unsigned axis = 0; axis < 3; ++axis) file.put(vertex_at(i, v, axis), leaf.vertex[v][axis]);
    }
    file.put(leaf_at(i) + 48, leaf.primitive);
    file.put(leaf_at(i) + 56, leaf.geometry | (leaf.last ? 0x80000000u : 0u));
    file.put(leaf_at(i) + 60, leaf.id);
  }
};

}  // namespace hiprt::test
