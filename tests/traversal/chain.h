#pragma once
/// A tree of any depth, deeper than builders make: for stacks whose capacity is the depth of the tree.

#include <hiprt_device/hiprt_device.h>

#include <cstring>
#include <limits>
#include <span>
#include <vector>

namespace hiprt::checks {

/// Levels of a tree that a RestartStack's trail covers.
inline constexpr unsigned kTrailLevels = 64;

/// Nodes in layout planes, each with one leaf of one triangle and the next node; the last has the leaf alone. Triangle
/// i is at z = i, at level i of the tree, and is met by lines along z through (0.25, 0.25).
class Chain {
 public:
  explicit Chain(unsigned levels)
      : levels_(levels), blocks_((levels * (sizeof(PlanesBoxNode) + sizeof(PlanesLeaf)) - 1) / sizeof(Block) + 1) {
    geometry_.mask = 0xffffffffu;
    for (unsigned i = 0; i < levels; ++i) {
      put(node_offset(i), node(i));
      put(leaf_offset(i), leaf(i));
    }
  }

  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(blocks_)); }
  const GeometryRecord& geometry() const { return geometry_; }
  /// @param base, geometry copies of the above, in the memory of the processor that traces.
  SceneView view(const std::byte* base, const GeometryRecord* geometry) const {
    SceneView scene{.base = base, .size = bytes().size(), .geometries = geometry};
    scene.root = make_ref(node_offset(0), NodeType::kBox32);
    scene.bounds = {{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, top()}};
    scene.features = feature_bit(Feature::kTriangles);
    return scene;
  }
  /// On the host.
  SceneView view() const { return view(bytes().data(), &geometry_); }

  /// Ray i meets triangle i alone, at t = 0.5, and visits the nodes down to its level.
  std::vector<Ray> rays() const {
    std::vector<Ray> rays(levels_);
    for (unsigned i = 0; i < levels_; ++i)
      rays[i] = {.origin = {0.25f, 0.25f, static_cast<float>(i) - 0.5f}, .tmax = 0.75f};
    return rays;
  }

 private:
  /// As a file is aligned.
  struct alignas(256) Block {
    std::byte bytes[256];
  };

  float top() const { return static_cast<float>(levels_ - 1); }
  std::size_t node_offset(unsigned i) const { return i * sizeof(PlanesBoxNode); }
  std::size_t leaf_offset(unsigned i) const { return levels_ * sizeof(PlanesBoxNode) + i * sizeof(PlanesLeaf); }
  template <class Record> void put(std::size_t offset, const Record& record) {
    std::memcpy(reinterpret_cast<std::byte*>(blocks_.data()) + offset, &record, sizeof record);
  }

  PlanesBoxNode node(unsigned i) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const Box empty{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    const float height = static_cast<float>(i);
    PlanesBoxNode node{};
    for (unsigned child = 0; child < kBranching; ++child) {
      node.child[child] = kInvalidRef;
      PlanesLayout::set_box(node, child, empty);
    }
    node.child[0] = make_ref(leaf_offset(i), NodeType::kTriangle0);
    PlanesLayout::set_box(node, 0, Box{{0.0f, 0.0f, height}, {1.0f, 1.0f, height}});
    if (i + 1 == levels_) return node;
    node.child[1] = make_ref(node_offset(i + 1), NodeType::kBox32);
    PlanesLayout::set_box(node, 1, Box{{0.0f, 0.0f, height + 1}, {1.0f, 1.0f, top()}});
    return node;
  }
  static PlanesLeaf leaf(unsigned i) {
    constexpr float kCorners[4][2] = {{0.0f, 0.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}, {0.0f, 1.0f}};
    PlanesLeaf leaf{};
    for (unsigned vertex = 0; vertex < 4; ++vertex) {
      leaf.coordinate[0][vertex] = kCorners[vertex][0];
      leaf.coordinate[1][vertex] = kCorners[vertex][1];
      leaf.coordinate[2][vertex] = static_cast<float>(i);
    }
    leaf.info = {{i, kInvalidId}, kLastInRun, TriangleId::from_rotation(0)};
    return leaf;
  }

  unsigned levels_;
  std::vector<Block> blocks_;
  GeometryRecord geometry_{};
};

}  // namespace hiprt::checks
