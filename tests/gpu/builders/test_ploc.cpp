// Locally-ordered clustering on the device makes the host's tree, byte for byte.

#include <hiprt_build/gpu/device_buffer.h>
#include <hiprt_build/lbvh_ploc/gpu_ploc.h>
#include <hiprt_build/lbvh_ploc/ploc.h>
#include <tests/build/machine.h>
#include <tests/gpu/results.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

using namespace hiprt;
using namespace hiprt::checks;
using build::LinkedNode;
using build::LinkedRef;

namespace {

constexpr std::uint64_t kSeed = 20261122;

struct Tree {
  std::vector<LinkedNode> nodes;
  LinkedRef root = kInvalidId;
};

Tree host_tree(const std::vector<Box>& boxes, unsigned radius) {
  Tree tree{std::vector<LinkedNode>(boxes.size())};
  build::Machine machine;
  const build::LinkedTree<build::BoxLeaves, build::NoSums> linked{{boxes.data()}, tree.nodes.data(), {}, &tree.root};
  if (!boxes.empty()) build::emit_ploc(machine.engine, linked, boxes.size(), radius);
  return tree;
}

/// @param capacity for leaves that do not exist, too. All memory is of noise before, another one in every run.
Tree device_tree(const std::vector<Box>& boxes, std::uint32_t capacity, unsigned radius, std::byte noise) {
  gpu::DeviceAllocator allocator;
  std::vector<build::Reference> leaves;
  leaves.reserve(capacity);
  for (const Box& box : boxes) leaves.push_back({box, build::LeafContents::none(), 0});
  leaves.resize(capacity, {boxes.empty() ? Box{} : boxes[0], build::LeafContents::none(), 0});
  const std::vector<std::uint32_t> count{static_cast<std::uint32_t>(boxes.size())};
  const auto references = must(gpu::DeviceArray<build::Reference>::from(leaves, nullptr, allocator));
  const auto device_count = must(gpu::DeviceArray<std::uint32_t>::from(count, nullptr, allocator));
  auto nodes = must(gpu::DeviceArray<LinkedNode>::make(capacity, nullptr, allocator));
  auto root = must(gpu::DeviceArray<LinkedRef>::make(1, nullptr, allocator));
  auto scratch = must(gpu::DeviceBuffer::make(gpu::ploc_scratch(capacity), nullptr, allocator));
  must(nodes.fill(noise, nullptr));
  must(scratch.fill(noise, nullptr));
  must(gpu::enqueue_ploc({references.data(), device_count.data(), capacity, radius}, {nodes.data(), root.data()},
                         scratch.data(), nullptr));
  return Tree{must(nodes.to_vector(nullptr)), must(root.to_vector(nullptr))[0]};
}

bool same_bytes(const LinkedNode& a, const LinkedNode& b) {
  using Words = std::array<std::uint32_t, sizeof(LinkedNode) / 4>;
  return std::bit_cast<Words>(a) == std::bit_cast<Words>(b);
}

void check_like_host(const std::vector<Box>& boxes, unsigned radius, std::uint32_t extra_capacity = 0) {
  const auto count = static_cast<std::uint32_t>(boxes.size());
  CAPTURE(count, radius, extra_capacity);
  const Tree host = host_tree(boxes, radius);
  for (const std::byte noise : {std::byte{0xa5}, std::byte{0x01}}) {
    const Tree device = device_tree(boxes, count + extra_capacity, radius, noise);
    REQUIRE(device.root == host.root);
    LinkedNode untouched;
    std::memset(&untouched, static_cast<int>(noise), sizeof untouched);
    for (std::uint32_t i = 0; i < device.nodes.size(); ++i) {
      const bool written = i > 0 && i < count;
      if (!same_bytes(device.nodes[i], written ? host.nodes[i] : untouched)) FAIL("node " << i << " differs");
    }
  }
}

std::vector<Box> random_boxes(std::uint32_t count, std::uint64_t seed) {
  oracle::Random random(seed);
  std::vector<Box> boxes;
  for (std::uint32_t i = 0; i < count; ++i) boxes.push_back(build::random_box(random));
  return boxes;
}

/// Of unit cubes: each is nearest to the one before.
std::vector<Box> row(std::uint32_t count) {
  std::vector<Box> boxes;
  float from = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    boxes.push_back(build::box_at({from, 0, 0}, {1, 1, 1}));
    from += 2.0f + 1e-3f * static_cast<float>(i);
  }
  return boxes;
}

/// Each around the one before; then the same again.
std::vector<Box> nests(std::uint32_t count, unsigned depth) {
  std::vector<Box> boxes;
  for (std::uint32_t i = 0; i < count * depth; ++i) {
    const float size = std::ldexp(1.0f, static_cast<int>(i % depth));
    boxes.push_back(build::box_at({0, 0, 0}, {size, size, size}));
  }
  return boxes;
}

}  // namespace

TEST_CASE("clusters of any number of leaves, with every radius") {
  INFO("seed " << kSeed);
  for (const std::uint32_t count : {0u, 1u, 2u, 3u, 63u, 257u, 1023u, 1024u, 1025u})
    for (const unsigned radius : {1u, 8u, 16u, 128u}) check_like_host(random_boxes(count, kSeed + count), radius);
}

TEST_CASE("clusters of many tiles") {
  INFO("seed " << kSeed);
  // A block's tile is 512 less twice the radius, the last block's 1024 less it.
  for (const unsigned radius : {1u, 8u, 128u})
    for (const std::uint32_t tile : {512 - 2 * radius, 1024 - 2 * radius})
      for (const std::uint32_t count : {5 * tile - 1, 5 * tile, 5 * tile + 1})
        check_like_host(random_boxes(count, kSeed + count), radius);
  check_like_host(random_boxes(40000, kSeed), 16);
}

TEST_CASE("clusters of fewer leaves than there is capacity for") {
  INFO("seed " << kSeed);
  for (const std::uint32_t count : {0u, 1u, 2u, 1000u, 3000u}) check_like_host(random_boxes(count, kSeed), 8, 4000);
  check_like_host(random_boxes(1000, kSeed), 8, 1);
}

TEST_CASE("clusters of equal boxes, and of areas that overflow") {
  constexpr float kMost = std::numeric_limits<float>::max();
  for (const Box& box : {Box{{1, 2, 3}, {2, 3, 4}}, Box{{-kMost, -kMost, -kMost}, {kMost, kMost, kMost}},
                         Box{{-kMost, 0, 0}, {kMost, 0, 0}}})
    for (const std::uint32_t count : {33u, 2000u}) check_like_host(std::vector<Box>(count, box), 8);
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  std::vector<Box> mixed = random_boxes(3000, kSeed);
  for (Box& box : mixed)
    for (unsigned axis = 0; axis < 3; ++axis) {
      const std::uint32_t kind = random.below(5);
      if (kind == 0) box.min[axis] = -kMost, box.max[axis] = kMost;
      if (kind == 1) box.max[axis] = box.min[axis] = 0;
    }
  check_like_host(mixed, 8);
}

TEST_CASE("clusters in rows in which each box is nearest to the one before") { check_like_host(row(5000), 8); }

TEST_CASE("clusters that are still numerous when the last block begins") {
  // Each nest joins about one pair in a round, and only 20 rounds are launched for 12000 leaves.
  check_like_host(nests(500, 24), 8);
}

TEST_CASE("invalid clusterings are refused") {
  const auto message = [](std::uint32_t capacity, unsigned radius) {
    return error_of(gpu::enqueue_ploc({nullptr, nullptr, capacity, radius}, {}, nullptr, nullptr)).message;
  };
  for (const unsigned radius : {0u, 129u})
    CHECK(message(1, radius) == "a PLOC radius of " + std::to_string(radius) + ", allowed are 1 to 128");
  CHECK(message(1u << 31, 8) == "PLOC of 2147483648 leaves, the limit is 2147483647");
}
