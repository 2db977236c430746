#include "bad_files.h"

#include <cmath>

namespace hiprt::test {

namespace {

std::vector<BadCase> half_cases() {
  using E = FormatError;
  const auto plane = [](unsigned node, unsigned child, unsigned side, unsigned axis) {
    return [=](const TestScene& scene) { return scene.plane_at(node, child, side, axis); };
  };
  const auto far_changed = [](const std::function<void(TestScene&)>& change,
                              const std::function<std::uint64_t(const TestScene&)>& offset_of) {
    return changed([](NodeLayout) { return far_scene(); }, change, offset_of);
  };
  constexpr std::uint16_t kNan = 0x7e00, kPositive = 0x7c00, kNegative = 0xfc00;
  return {
      {E::kBadBox, "NaN", row_with(plane(1, 1, 0, 1), kNan), only_half},
      {E::kBadBox, "min = +inf", row_with(plane(1, 3, 0, 2), kPositive), only_half},
      {E::kBadBox, "max = -inf", row_with(plane(1, 3, 1, 2), kNegative), only_half},
      {E::kBadBox, "absent child, finite plane", row_with(plane(0, 1, 1, 1), std::uint16_t{0}), only_half},
      {E::kBadBox, "absent child, unbounded", row_with(plane(0, 3, 0, 0), kNegative), only_half},
      {E::kBoxNotContained, "unbounded below a bounded box", row_with(plane(1, 1, 0, 0), kNegative), only_half},
      {E::kBoxNotContained, "the smallest subnormal below zero", row_with(plane(1, 3, 0, 1), std::uint16_t{0x8001}),
       only_half},
      {E::kBoxNotContained, "a triangle leaves bounds that replace an infinite plane",
       far_changed([](TestScene& s) { s.root.box.max[0] = 9e29f; },
                   [](const TestScene& s) { return s.vertex_at(1, 1, 0); }),
       only_half},
      {E::kBadBounds, "infinite as the planes are",
       far_changed([](TestScene& s) { s.root.box.min[0] = -kInf; }, [](const TestScene&) { return 56; }), only_half},
  };
}

/// A node with one child per axis to patch: row_scene()'s node 1, whose slots 1 and 3 are in use.
std::vector<BadCase> quantized_cases() {
  using E = FormatError;
  const auto field = [](std::uint64_t byte) { return [=](const TestScene& s) { return s.node_at(1) + byte; }; };
  const auto with_plane = [](std::uint64_t byte, auto value, unsigned side, unsigned axis) {
    return [=](NodeLayout layout) {
      const TestScene scene = row_scene(layout);
      return BadFile{patched(scene, scene.node_at(1) + byte, value).file, scene.plane_at(1, 1, side, axis)};
    };
  };
  const auto plane = [](unsigned child, unsigned side, unsigned axis) {
    return [=](const TestScene& scene) { return scene.plane_at(1, child, side, axis); };
  };
  constexpr std::uint64_t kExponents = 12, kChildren = 15;
  std::vector<BadCase> cases{
      {E::kBadChildSlots, "a child too many", row_with(field(kChildren), std::uint8_t{0xb}), only_quantized},
      {E::kBadChildSlots, "a child too few", row_with(field(kChildren), std::uint8_t{0x2}), only_quantized},
      {E::kBadChildSlots, "axis 3", row_with(field(kChildren), std::uint8_t{0x3a}), only_quantized},
      {E::kBadReservedField, "bit 6 of the children byte", row_with(field(kChildren), std::uint8_t{0x4a}),
       only_quantized},
      {E::kBadReservedField, "bit 7 of the children byte", row_with(field(kChildren), std::uint8_t{0x8a}),
       only_quantized},
      {E::kInexactPlane, "the largest origin, which is no grid's for small steps", with_plane(0, 0x1p126f, 0, 0),
       only_quantized},
      {E::kInexactPlane, "2^127, exactly",
       [](NodeLayout layout) {
         const TestScene scene = row_scene(layout);
         BadFile bad{scene.write(), scene.plane_at(1, 1, 0, 1)};
         bad.file.put(scene.node_at(1) + 4, 0.0f);
         bad.file.put(scene.node_at(1) + kExponents + 1, std::uint8_t{250});
         bad.file.seal();
         return bad;
       },
       only_quantized},
      {E::kBadGrid, "exponent 0", row_with(field(kExponents + 1), std::uint8_t{0}), only_quantized},
      {E::kBadGrid, "exponent 255", row_with(field(kExponents + 2), std::uint8_t{255}), only_quantized},
      {E::kBadGrid, "origin beyond 2^126", row_with(field(4), std::nextafter(-0x1p126f, -kInf)), only_quantized},
      {E::kBadGrid, "infinite origin", row_with(field(0), kInf), only_quantized},
      {E::kBadGrid, "origin NaN", row_with(field(8), std::numeric_limits<float>::quiet_NaN()), only_quantized},
      {E::kInexactPlane, "scale far below the origin's last bit", with_plane(kExponents, std::uint8_t{1}, 0, 0),
       only_quantized},
      {E::kInexactPlane, "origin far below the scale", with_plane(0, 0x1p-100f, 0, 0), only_quantized},
      {E::kInexactPlane, "origin with one bit too many", with_plane(0, std::nextafter(3.0f, 4.0f), 0, 0),
       only_quantized},
      {E::kInexactPlane, "beyond 2^126", with_plane(kExponents + 1, std::uint8_t{254}, 0, 1), only_quantized},
      {E::kBadBox, "absent child, another minimum", row_with(plane(0, 0, 1), std::uint8_t{254}), only_quantized},
      {E::kBadBox, "absent child, another maximum", row_with(plane(2, 1, 2), std::uint8_t{1}), only_quantized},
      {E::kBoxNotContained, "one step below the parent's box", row_with(plane(1, 0, 0), std::uint8_t{7}),
       only_quantized},
  };
  return cases;
}

/// custom_scene() changed by @p change; the report must name offset_of(scene).
std::function<BadFile(NodeLayout)> custom_changed(const std::function<void(TestScene&)>& change,
                                                  const std::function<std::uint64_t(const TestScene&)>& offset_of) {
  return changed(custom_scene, change, offset_of);
}
auto info_at(unsigned leaf, unsigned field) {
  return [=](const TestScene& scene) { return scene.leaf_at(leaf) + 48 + field; };
}

std::vector<BadCase> custom_id_cases() {
  using E = FormatError;
  return {
      {E::kBadGeometryId, "custom primitives of a mesh",
       custom_changed([](TestScene& s) { s.leaves[3].geometry = 0; }, info_at(3, 8))},
      {E::kBadGeometryId, "custom leaves by a reference to triangles",
       custom_changed([](TestScene& s) { s.nodes[0][2].kind = ChildKind::kLeaves, s.nodes[0][2].flags = 5; },
                      info_at(2, 8))},
      {E::kBadPrimitiveId, "6 of 6", custom_changed([](TestScene& s) { s.leaves[3].primitive[1] = 6; }, info_at(3, 4))},
      {E::kBadTriangleId, "a triangle's",
       custom_changed([](TestScene& s) { s.leaves[3].id[1] = 0x89; }, info_at(3, 13))},
      {E::kBadTriangleId, "not opaque", custom_changed([](TestScene& s) { s.leaves[1].id[0] = 0x40; }, info_at(1, 12))},
      {E::kBadTriangleId, "of an absent primitive",
       custom_changed([](TestScene& s) { s.leaves[2].id[1] = 0xc0; }, info_at(2, 13))},
      {E::kBadTriangleId, "a custom primitive's of a triangle",
       custom_changed([](TestScene& s) { s.leaves[0].id[0] = 0xc0; }, info_at(0, 12))},
      {E::kBadGeometryId, "a run of both kinds",
       custom_changed(
           [](TestScene& s) {
             s.leaves[0].last = false;
             s.nodes[1][1].box = s.nodes[0][0].box;
             s.nodes[1][3] = {};
             s.nodes[0][0].flags = 5;
           },
           info_at(1, 8))},
  };
}

std::vector<BadCase> custom_box_cases() {
  using E = FormatError;
  const auto plane = [](unsigned leaf, unsigned which, unsigned side, unsigned axis) {
    return [=](const TestScene& scene) { return scene.custom_plane_at(leaf, which, side, axis); };
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  return {
      {E::kBadBox, "NaN", custom_changed([=](TestScene& s) { s.leaves[1].box[1].max[2] = nan; }, plane(1, 1, 1, 2))},
      {E::kBadBox, "infinite",
       custom_changed([](TestScene& s) { s.leaves[3].box[0].min[0] = -kInf; }, plane(3, 0, 0, 0))},
      {E::kBadBox, "inverted",
       custom_changed([](TestScene& s) { s.leaves[3].box[1].min[1] = 0.5f; }, plane(3, 1, 0, 1))},
      {E::kBadBox, "of an absent primitive",
       custom_changed([](TestScene& s) { s.leaves[2].box[1] = s.leaves[2].box[0]; }, plane(2, 1, 0, 0))},
      {E::kBoxNotContained, "custom primitive leaves the box",
       custom_changed([](TestScene& s) { s.leaves[3].box[0].max[0] = std::nextafter(7.0f, 8.0f); }, plane(3, 0, 1, 0))},
      {E::kBoxNotContained, "custom primitive leaves the bounds",
       changed(
           custom_root_scene, [](TestScene& s) { s.root.box.min[1] = 0.5f; }, plane(0, 0, 0, 1))},
  };
}

std::vector<BadCase> custom_tree_cases() {
  using E = FormatError;
  const auto flags = [](unsigned node, unsigned child) {
    return [=](const TestScene& scene) { return scene.flags_at(node, child); };
  };
  const auto features = [](const TestScene&) -> std::uint64_t { return 16; };
  return {
      {E::kFeatureMismatch, "custom missing",
       changed(
           custom_root_scene, [](TestScene& s) { s.features = 1; }, features)},
      {E::kFeatureMismatch, "triangles without triangle leaves",
       changed(
           custom_root_scene, [](TestScene& s) { s.features = 9; }, features)},
      {E::kSplitCustom, "twice in a leaf",
       custom_changed([](TestScene& s) { s.leaves[1].primitive[1] = 0; }, info_at(1, 4))},
      {E::kSplitCustom, "in two leaves, splits allowed",
       custom_changed([](TestScene& s) { s.features |= 4, s.leaves[2].primitive[0] = 5; }, info_at(3, 0))},
      {E::kBadChildFlags, "mixed called triangles",
       custom_changed([](TestScene& s) { s.nodes[0][0].flags = 5; }, flags(0, 0)), not_half},
      {E::kBadChildFlags, "mixed called procedural",
       custom_changed([](TestScene& s) { s.nodes[0][0].flags = 9; }, flags(0, 0)), not_half},
      {E::kBadChildFlags, "procedural called mixed",
       custom_changed([](TestScene& s) { s.nodes[1][3].flags = 1; }, flags(1, 3)), not_half},
      {E::kBadChildFlags, "of an absent child",
       custom_changed([](TestScene& s) { s.nodes[1][0].flags = 1; }, flags(1, 0)), not_half},
      {E::kDroppedCount, "custom",
       custom_changed([](TestScene& s) { s.geometries[1].dropped_count = 0; },
                      [](const TestScene& s) { return s.geometries_at() + 32 + 16; })},
      {E::kPrimitiveMapMismatch, "the custom leaf's other primitive",
       custom_changed([](TestScene& s) { s.map[2] = 3; }, [](const TestScene& s) { return s.map_at() + 8; })},
  };
}

}  // namespace

std::vector<BadCase> encoding_cases() {
  std::vector<BadCase> all = half_cases();
  for (BadCase& bad : quantized_cases()) all.push_back(std::move(bad));
  return all;
}

std::vector<BadCase> custom_cases() {
  std::vector<BadCase> all;
  for (auto* part : {custom_id_cases, custom_box_cases, custom_tree_cases})
    for (BadCase& bad : part()) all.push_back(std::move(bad));
  return all;
}

}  // namespace hiprt::test
