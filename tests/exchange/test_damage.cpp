// Random damage to a valid exchange tree: if the check accepts it, the built file is valid and its hits are right.

#include "trees.h"

#include <hiprt_build/format/validate.h>
#include <tests/oracle/odd_meshes.h>
#include <tests/traversal/every_hit.h>

#include <bit>

using namespace hiprt;
using namespace hiprt::checks;
using namespace hiprt::test;

namespace {

constexpr std::uint64_t kSeed = 99;
constexpr unsigned kTrees = 4000;

/// A wrong number that a check could miss: small, near the old one, or arbitrary.
std::uint32_t damaged(std::uint32_t value, Random& random) {
  switch (random.below(5)) {
    case 0:
      return random.below(8);
    case 1:
      return value + 1;
    case 2:
      return value - 1;
    case 3:
      return static_cast<std::uint32_t>(random.bits());
    default:
      return random.below(60);
  }
}

float damaged(float value, Random& random) {
  switch (random.below(4)) {
    case 0:
      return random.any_float();
    case 1:
      return value * 1.5f;
    case 2:
      return -value;
    default:
      return random.uniform_float(-2, 2);
  }
}

void damage(ExchangeBvh& tree, Random& random) {
  const auto any = [&](std::size_t size) { return random.below(static_cast<std::uint32_t>(size)); };
  ExchangeNode& node = tree.nodes[any(tree.nodes.size())];
  switch (random.below(9)) {
    case 0:
      node.first = damaged(node.first, random);
      break;
    case 1:
      node.children = damaged(node.children, random);
      break;
    case 2:
      node.primitives = damaged(node.primitives, random);
      break;
    case 3:
    case 4: {
      float& plane = (random.coin() ? node.box.min : node.box.max)[random.below(3)];
      plane = damaged(plane, random);
      break;
    }
    case 5:
      node = tree.nodes[any(tree.nodes.size())];
      break;
    case 6:
      std::swap(node, tree.nodes[any(tree.nodes.size())]);
      break;
    case 7: {
      std::uint32_t& primitive = tree.primitives[any(tree.primitives.size())];
      primitive = random.coin() ? tree.primitives[any(tree.primitives.size())] : damaged(primitive, random);
      break;
    }
    default:
      random.coin() ? tree.nodes.pop_back() : tree.primitives.pop_back();
  }
}

/// Makes some leaves hold one more primitive, which is in another leaf, too.
void share_some(ExchangeBvh& tree, std::uint32_t primitives, Random& random) {
  std::vector<std::uint32_t> entries;
  for (ExchangeNode& node : tree.nodes) {
    if (node.children != 0) continue;
    const auto first = static_cast<std::uint32_t>(entries.size());
    for (std::uint32_t i = 0; i < node.primitives; ++i) entries.push_back(tree.primitives[node.first + i]);
    if (random.below(8) == 0) {
      entries.push_back(random.below(primitives));
      ++node.primitives;
    }
    node.first = first;
  }
  tree.primitives = entries;
}

}  // namespace

TEST_CASE("damaged trees are refused or give right files") {
  INFO("seed " << kSeed);
  const std::vector<Mesh> meshes{soup(30, 0.8, kSeed), torture(20, kSeed)};
  const auto views = oracle::views(meshes);
  const std::vector<Box> boxes = primitive_boxes(meshes);
  Random random(kSeed);
  unsigned accepted = 0, split = 0;
  for (unsigned i = 0; i < kTrees; ++i) {
    CAPTURE(i);
    ExchangeBvh tree = random_tree(boxes, {2 + i % 3, 1 + i % 5}, kSeed + i);
    if (random.coin()) share_some(tree, static_cast<std::uint32_t>(boxes.size()), random);
    for (unsigned changes = random.below(4); changes > 0; --changes) damage(tree, random);
    const auto good = build::validate(tree, {.meshes = views});
    const auto bvh =
        build::import_tree({.meshes = views}, tree, {.nodes = NodeLayout::kHalf, .reinsertion_rounds = i % 2});
    REQUIRE(good.has_value() == bvh.has_value());
    if (!good) {
      REQUIRE(good.error().message == bvh.error().message);
      continue;
    }
    ++accepted;
    const auto valid = hiprt::validate(bvh->buffer.bytes());
    INFO((valid ? "" : to_string(valid.error())));
    REQUIRE(valid);
    split += valid->split != 0 ? 1 : 0;
    const SceneView scene = make_scene_view(*open_buffer(bvh->buffer.bytes()));
    for (unsigned k = 0; k < 4; ++k) {
      const Ray ray{vec3(random.in_cube(1.2)), 0.0f, vec3(random.in_cube(1))};
      const auto all = every_hit(meshes, ray);
      REQUIRE(same_hit(closest_hit(scene, ray), all.empty() ? Hit{} : all[0]));
    }
  }
  std::printf("%u of %u damaged trees accepted, %u of them with split triangles\n", accepted, kTrees, split);
  CHECK(split > accepted / 20);
  CHECK(accepted > kTrees / 50);
  CHECK(accepted < kTrees / 2);
}
