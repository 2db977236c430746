// Invalid exchange trees: the error names the position. Trees of any shape and depth are accepted.

#include "trees.h"

#include <tests/oracle/meshes.h>
#include <tests/oracle/odd_meshes.h>

#include <limits>

using namespace hiprt;
using namespace hiprt::oracle;
using namespace hiprt::test;
using build::CustomGeometry;
using build::SceneInput;
using build::TriangleMesh;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

/// Three triangles and a custom box side by side along x, in a tree of seven nodes:
///     0 -> 1 (primitive 0), 2, 3 (primitive 3)    2 -> 4 (primitive 1), 5 (primitive 2)
struct Small {
  Mesh first, second;
  std::vector<Box> boxes{{{3, 0, 0}, {4, 1, 0}}};
  std::vector<TriangleMesh> meshes;
  std::vector<CustomGeometry> customs{{boxes, 1, 0xffffffffu, "hair"}};
  ExchangeBvh tree;

  Small() {
    append(first, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    append(first, {1, 0, 0}, {2, 0, 0}, {1, 1, 0});
    append(second, {2, 0, 0}, {3, 0, 0}, {2, 1, 0});
    meshes = {first.view(), second.view()};
    meshes[1].name = "chair";
    tree.nodes = {{over(0, 4), 1, 3, 0}, {over(0, 1), 0, 0, 1}, {over(1, 3), 4, 2, 0},
                  {over(3, 4), 3, 0, 1}, {over(1, 2), 1, 0, 1}, {over(2, 3), 2, 0, 1}};
    tree.primitives = {0, 1, 2, 3};
  }
  Small(const Small&) = delete;
  Small& operator=(const Small&) = delete;

  static Box over(float low, float high) { return Box{{low, 0, 0}, {high, 1, 0}}; }
  SceneInput scene() const { return {meshes, customs}; }

  /// The message of a refusal, which the import repeats; "" if the tree is accepted.
  std::string refusal() const {
    const auto good = build::validate(tree, scene());
    const auto bvh = build::import_tree(scene(), tree);
    CHECK(good.has_value() == bvh.has_value());
    if (good) return "";
    CHECK(good.error().code == build::ErrorCode::kInvalidInput);
    CHECK(good.error().message == bvh.error().message);
    return good.error().message;
  }
};

template <class Change> std::string refusal(const Change& change) {
  Small small;
  change(small);
  return small.refusal();
}

std::string refused_tree(void (*change)(ExchangeBvh&)) {
  return refusal([&](Small& small) { change(small.tree); });
}

}  // namespace

TEST_CASE("a tree over meshes and custom primitives is accepted") { CHECK(Small().refusal().empty()); }

TEST_CASE("nodes that are neither inner nodes nor leaves are refused") {
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[4].primitives = 0; }) ==
        "node 4 has neither children nor primitives");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[2].primitives = 7; }) ==
        "node 2 has both children (2) and primitives (7)");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[0].children = 1; }) ==
        "node 0 has 1 children, allowed are 2 to 4");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[0].children = 5; }) ==
        "node 0 has 5 children, allowed are 2 to 4");
}

TEST_CASE("node numbers out of range and graphs that are not trees are refused") {
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[2].first = 5; }) ==
        "node 2: its children are nodes [5, 7), but there are 6 nodes");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[2].first = 0xffffffffu; }) ==
        "node 2: its children are nodes [4294967295, 4294967297), but there are 6 nodes");
  // A circle: the node's own parent, and itself.
  CHECK(refused_tree([](ExchangeBvh& tree) {
          for (ExchangeNode& node : tree.nodes) node.box = tree.nodes[0].box;
          tree.nodes[2].first = 0;
        }) == "node 2, child 0: node 0 is the root");
  CHECK(refused_tree([](ExchangeBvh& tree) {
          for (ExchangeNode& node : tree.nodes) node.box = tree.nodes[0].box;
          tree.nodes[2].first = 2;
        }) == "node 2, child 0: node 2 is the child of two nodes");
  // Shared: node 3 is a child of 0, too.
  CHECK(refused_tree([](ExchangeBvh& tree) {
          for (ExchangeNode& node : tree.nodes) node.box = tree.nodes[0].box;
          tree.nodes[2].first = 3;
        }) == "node 2, child 0: node 3 is the child of two nodes");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes.push_back(tree.nodes[5]); }) ==
        "node 6 is not reached from the root");
  // A circle beside the tree.
  CHECK(refused_tree([](ExchangeBvh& tree) {
          tree.nodes.push_back({tree.nodes[0].box, 6, 2, 0});
          tree.nodes.push_back({tree.nodes[0].box, 6, 2, 0});
        }) == "node 6 is not reached from the root");
}

TEST_CASE("boxes that are not finite, inverted or outside of the parent's are refused") {
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[0].box.min[1] = kNan; }) ==
        "node 0: its box is from nan to 1 in y, which is no finite range");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[5].box.max[2] = kNan; }) ==
        "node 5: its box is from 0 to nan in z, which is no finite range");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[0].box.max[0] = kInfinity; }) ==
        "node 0: its box is from 0 to inf in x, which is no finite range");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[3].box.min[1] = 2; }) ==
        "node 3: its box is from 2 to 1 in y, which is no finite range");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[5].box.max[0] = std::nextafter(3.0f, 4.0f); }) ==
        "node 2, child 1 (node 5): its box leaves the parent's: max x 3.00000024 is outside of 3");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[0].box.min[1] = 0x1p-149f; }) ==
        "node 0, child 0 (node 1): its box leaves the parent's: min y 0 is outside of 1.40129846e-45");
}

TEST_CASE("primitives out of range, in no leaf, twice in one or outside of its box are refused") {
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[3].primitives = 2; }) ==
        "node 3: its primitives are entries [3, 5), but there are 4 entries");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.primitives[2] = 4; }) ==
        "node 5, entry 2: primitive 4, but there are 4");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[3].first = 1; }) == "node 3, entry 1 is in another leaf, too");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.primitives.push_back(0); }) ==
        "entry 4 of the primitives is in no leaf");
  CHECK(refused_tree([](ExchangeBvh& tree) {
          tree.primitives = {0, 1, 2, 3, 3};
          tree.nodes[3].primitives = 2;
        }) == "node 3, entry 4: primitive 3 is in this leaf twice");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.primitives[2] = 0; }) ==
        "mesh 1 (chair), triangle 0: in no leaf (primitive 2 of all)");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.primitives[3] = 0; }) ==
        "custom geometry 0 (hair), primitive 0: in no leaf (primitive 3 of all)");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[5].box.max[1] = 0.5f; }) ==
        "mesh 1 (chair), triangle 0: leaves the box of node 5, the only leaf that it is in: max y 1 is outside of 0.5");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes[3].box.min[0] = 3.5f; }) ==
        "custom geometry 0 (hair), primitive 0: leaves the box of node 3, the only leaf that it is in: min x 3 is "
        "outside "
        "of 3.5");
}

TEST_CASE("a primitive in two leaves may extend beyond both boxes") {
  Small small;
  // Triangle 1 is split at x = 1.5, and its parts are in leaves 4 and 6.
  small.tree.nodes[2] = {Small::over(1, 3), 4, 3, 0};
  small.tree.nodes[4].box = Small::over(1, 1.5f);
  small.tree.nodes.push_back({Small::over(1.5f, 2), 4, 0, 1});
  small.tree.primitives.push_back(1);
  CHECK(small.refusal().empty());
  const auto bvh = build::import_tree(small.scene(), small.tree);
  REQUIRE(bvh.has_value());
  CHECK(bvh->statistics.leaves == 5);
  // The custom primitive in the leaves 3 and 6, too: it is not split.
  small.tree.nodes[6].primitives = 2;
  small.tree.primitives.push_back(3);
  const auto other = build::import_tree(small.scene(), small.tree);
  REQUIRE(other.has_value());
  CHECK(other->statistics.leaves == 5);
}

TEST_CASE("dropped primitives may be anywhere or nowhere") {
  const auto drop = [](Small& small) { small.first.positions[3][0] = kNan; };
  CHECK(refusal(drop).empty());
  CHECK(refusal([&](Small& small) {
          drop(small);
          small.tree.primitives[1] = 0;  // Primitive 1 is in no leaf, 0 in two.
        }).empty());
  // A degenerate triangle far outside of its leaf, and a leaf with nothing else.
  CHECK(refusal([](Small& small) { small.first.positions[3] = small.first.positions[4] = {99, 99, 99}; }).empty());
  CHECK(refusal([](Small& small) { small.boxes[0].min[0] = 5; }).empty());
}

TEST_CASE("scenes that cannot be built are refused with the mesh and triangle") {
  CHECK(refusal([](Small& small) { small.second.triangles[0][2] = 3; }) ==
        "mesh 1 (chair), triangle 0: index 3, but there are 3 vertices");
  const build::Position position{};
  const build::Triangle triangle{};
  const TriangleMesh huge{{&position, 1}, {&triangle, std::size_t{1} << 30}};
  const auto refused = build::validate(ExchangeBvh{}, {.meshes = {&huge, 1}});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == build::ErrorCode::kTooLarge);
}

TEST_CASE("scenes without primitives have no nodes; all other scenes need nodes") {
  CHECK(build::validate(ExchangeBvh{}, SceneInput{}).has_value());
  CHECK(build::import_tree(SceneInput{}, ExchangeBvh{}).has_value());
  CHECK(refused_tree([](ExchangeBvh& tree) { tree = {}; }) == "mesh 0, triangle 0: in no leaf (primitive 0 of all)");
  CHECK(refused_tree([](ExchangeBvh& tree) { tree.nodes.clear(); }) == "entry 0 of the primitives is in no leaf");
  // All dropped: with leaves or without.
  Mesh mesh;
  append(mesh, {kNan, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const std::vector meshes{mesh.view()};
  CHECK(build::validate(ExchangeBvh{}, {.meshes = meshes}).has_value());
  const ExchangeBvh tree{{{Box{}, 0, 0, 1}}, {0}};
  const auto bvh = build::import_tree({.meshes = meshes}, tree);
  REQUIRE(bvh.has_value());
  CHECK(bvh->statistics.leaves == 0);
  CHECK(bvh->statistics.dropped_not_finite == 1);
}

TEST_CASE("random trees of every shape are accepted") {
  const std::vector<Mesh> meshes{soup(300, 0.3, 1), torture(300, 2)};
  const auto views = oracle::views(meshes);
  const std::vector<Box> boxes = primitive_boxes(meshes);
  for (const TreeShape& shape : {TreeShape{2, 1}, TreeShape{3, 2}, TreeShape{4, 7}, TreeShape{4, 1000}}) {
    CAPTURE(shape.branching, shape.leaf);
    const auto good = build::validate(random_tree(boxes, shape, 3), {.meshes = views});
    INFO((good ? "" : good.error().message));
    CHECK(good.has_value());
  }
}

TEST_CASE("the builder imported needs a tree") {
  const auto refused = build::build(SceneInput{}, {.builder = build::Builder::kImported});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == build::ErrorCode::kInvalidInput);
  CHECK_THAT(refused.error().message, Catch::Contains("import_tree"));
  CHECK(build::name(build::Builder::kImported) == std::string("imported"));
}
