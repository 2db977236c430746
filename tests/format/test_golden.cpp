/// Files that golden/make_golden.py made from FORMAT.md: whole, truncated, and with every bit flipped.

#include "safe_walk.h"
#include "test_scene.h"

#include <hiprt_build/format/validate.h>
#include <hiprt_device/format/layout.h>

#include <tests/catch.h>
#include <tests/oracle/nodes_of.h>

#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <iterator>

using namespace hiprt;
using namespace hiprt::test;

namespace {

struct Golden {
  const char* name;
  TestScene scene;

  TestFile read() const {
    std::ifstream file(std::string(HIPRT_GOLDEN_FOLDER) + "/" + name, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    REQUIRE_FALSE(bytes.empty());
    return TestFile(std::as_bytes(std::span(bytes)));
  }
};

Golden row_golden() {
  return GENERATE(
      Golden{"float.bvh", row_scene(NodeLayout::kFloat)}, Golden{"planes.bvh", row_scene(NodeLayout::kPlanes)},
      Golden{"half.bvh", row_scene(NodeLayout::kHalf)}, Golden{"quantized.bvh", row_scene(NodeLayout::kQuantized)});
}
Golden custom_golden() { return {"custom.bvh", custom_scene(NodeLayout::kPlanes)}; }
Golden any_golden() { return GENERATE(false, true) ? custom_golden() : row_golden(); }

bool same_box(const Box& a, const Box& b) {
  using Bits = std::array<std::uint32_t, 6>;
  return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

template <class Layout> void check_decoded(const BufferView& view, const TestScene& scene) {
  const auto nodes = oracle::nodes_of<typename Layout::Node>(view);
  const auto leaves = view.records<typename Layout::Leaf>(view.leaves);
  REQUIRE(nodes.size() == 2);
  REQUIRE(leaves.size() == 4);
  CHECK(view.header->root == make_ref(384, Layout::kBoxType));
  CHECK(nodes[0].child[0] == make_ref(scene.leaf_at(0), NodeType::kTriangle0));
  CHECK(nodes[0].child[1] == kInvalidRef);
  CHECK(nodes[0].child[2] == make_ref(384 + scene.node_size(), Layout::kBoxType));
  CHECK(nodes[1].child[3] == make_ref(scene.leaf_at(0) + 3 * 64, NodeType::kTriangle0));
  CHECK(same_box(Layout::box(nodes[0], 0), row_box(0, 1)));
  CHECK(same_box(Layout::box(nodes[0], 1), kEmpty));
  CHECK(same_box(Layout::box(nodes[0], 2), row_box(2, 3)));
  CHECK(same_box(Layout::box(nodes[1], 3), row_box(3, 3)));
  CHECK(Layout::child_flags(nodes[0]) == (Layout::kHasChildFlags ? 0x00050005u : 0u));
  for (unsigned leaf = 0; leaf < 4; ++leaf)
    for (unsigned v = 0; v < 4; ++v) {
      const unsigned stored = leaf == 2 && v == 3 ? 2 : v;
      CHECK(Layout::coordinate(leaves[leaf], v, 0) == static_cast<float>(2 * leaf + (stored & 1u)));
      CHECK(Layout::coordinate(leaves[leaf], v, 1) == static_cast<float>(stored >> 1));
      CHECK(Layout::coordinate(leaves[leaf], v, 2) == 0.0f);
    }
  CHECK(leaves[0].info.geometry_and_flags == 0u);
  CHECK(leaves[1].info.geometry_and_flags == kLastInRun);
  CHECK(leaves[3].info.geometry_and_flags == (kLastInRun | 1u));
  CHECK(leaves[2].info.primitive[0] == 5);
  CHECK(leaves[2].info.primitive[1] == kInvalidId);
  CHECK(leaves[3].info.triangle_ids == (TriangleId::from_rotation(1) | TriangleId::from_rotation(2) << 8));
}

}  // namespace

TEST_CASE("golden files match the specification") {
  const Golden golden = row_golden();
  const NodeLayout layout = golden.scene.layout;
  const TestFile file = golden.read();
  const auto valid = validate(file.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
  CHECK(valid->leaf_triangles == 7);
  const auto view = open_buffer(file.bytes());
  REQUIRE(view);
  CHECK(view->layout() == layout);
  CHECK(view->provenance == row_scene(layout).provenance);
  CHECK(view->geometries[1].mask == 2);
  CHECK(view->geometries[1].first_primitive == 6);
  const std::vector<std::uint32_t> map(view->primitive_map.begin(), view->primitive_map.end());
  CHECK(map == row_scene(layout).map);
  CHECK(view->header->version_minor == (layout == NodeLayout::kFloat || layout == NodeLayout::kPlanes ? 0 : 1));
  dispatch_layout(layout, [&](auto tag) { check_decoded<decltype(tag)>(*view, golden.scene); });
}

TEST_CASE("the golden file with custom leaves matches the specification") {
  const TestFile file = custom_golden().read();
  const auto valid = validate(file.bytes());
  INFO((valid ? "" : to_string(valid.error())));
  REQUIRE(valid);
  const auto view = open_buffer(file.bytes());
  REQUIRE(view);
  CHECK(view->header->features == (feature_bit(Feature::kTriangles) | feature_bit(Feature::kCustom)));
  CHECK(view->geometries[0].flags == 0);
  CHECK(view->geometries[1].flags == custom_geometry_flags(7));
  CHECK(geometry_type(view->geometries[1].flags) == 7);
  const auto nodes = oracle::nodes_of<PlanesBoxNode>(*view);
  const auto leaves = view->records<PlanesLeaf>(view->leaves);
  CHECK(ref_type(nodes[0].child[2]) == NodeType::kProcedural);
  CHECK(nodes[0].child_flags == (kChildOnlyOpaque | (kChildOnlyOpaque | kChildOnlyProcedural) << 16));
  CHECK(same_box(hiprt::custom_leaf(leaves[1]).box[1], {{2.5f, 0.5f, 0}, {3.5f, 1.5f, 1}}));
  CHECK(same_box(hiprt::custom_leaf(leaves[2]).box[1], kEmpty));
  CHECK(leaves[3].info.triangle_ids == (TriangleId::kCustom | TriangleId::kCustom << 8));
  CHECK(leaves[3].info.primitive[0] == 5);
}

TEST_CASE("the tests' writer and the golden script agree byte by byte") {
  const Golden golden = any_golden();
  const TestFile file = golden.read(), written = golden.scene.write();
  REQUIRE(file.size() == written.size());
  CHECK(std::memcmp(file.data(), written.data(), file.size()) == 0);
}

TEST_CASE("a golden file truncated at any length is refused") {
  const TestFile whole = any_golden().read();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const TestFile truncated(whole.bytes().first(size));
    const auto result = validate(truncated.bytes());
    INFO("size " << size);
    REQUIRE_FALSE(result);
    CHECK(result.error().error == (size < 128 ? FormatError::kTooSmall : FormatError::kSizeMismatch));
  }
}

TEST_CASE("a golden file truncated at any length and sealed again is refused") {
  const TestFile whole = any_golden().read();
  for (std::size_t size = 128; size < whole.size(); ++size) {
    TestFile truncated(whole.bytes().first(size));
    truncated.seal();
    INFO("size " << size);
    REQUIRE_FALSE(validate(truncated.bytes()));
  }
}

TEST_CASE("a golden file with any bit flipped is refused") {
  TestFile file = any_golden().read();
  for (std::size_t bit = 0; bit < 8 * file.size(); ++bit) {
    const auto before = file.get<std::uint8_t>(bit / 8);
    file.put(bit / 8, static_cast<std::uint8_t>(before ^ 1u << bit % 8));
    // An accepted minor version is the only field that a reader may see changed, and the checksum covers it too.
    INFO("bit " << bit);
    REQUIRE_FALSE(validate(file.bytes()));
    file.put(bit / 8, before);
  }
}

TEST_CASE("a golden file with any bit flipped and sealed again is refused or safe to trace") {
  const TestFile whole = any_golden().read();
  std::size_t accepted = 0;
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    TestFile file = whole;
    file.put(bit / 8, static_cast<std::uint8_t>(whole.get<std::uint8_t>(bit / 8) ^ 1u << bit % 8));
    file.seal();
    const auto result = validate(file.bytes());
    if (!result) continue;
    ++accepted;
    INFO("bit " << bit);
    CHECK(walk_problem(file.bytes()) == "");
    CHECK(result->primitives == 8);
    CHECK(result->dropped == 1);
  }
  CHECK(accepted > 0);  // Vertices may move inside their box, and masks may change.
}
