#include "bad_files.h"

#include <hiprt_build/format/dispatch_layout.h>
#include <cmath>
#include <limits>
#include <utility>

namespace hiprt::test {

namespace {

std::function<BadFile(NodeLayout)> row_changed(const std::function<void(TestScene&)>& change,
                                               const std::function<std::uint64_t(const TestScene&)>& offset_of) {
  return changed(row_scene, change, offset_of);
}

std::vector<BadCase> reference_cases() {
  using E = FormatError;
  const auto root = [](const TestScene&) -> std::uint64_t { return 44; };
  const auto child = [](unsigned node, unsigned slot) {
    return [=](const TestScene& scene) { return scene.child_at(node, slot); };
  };
  const auto node = [](unsigned i, unsigned plus = 0) {
    return [=](const TestScene& scene) { return scene.node_at(i) + plus; };
  };
  const auto leaf = [](unsigned i) { return [=](const TestScene& scene) { return scene.leaf_at(i); }; };
  const auto at_byte = [](std::uint64_t byte) { return [=](const TestScene&) { return byte; }; };
  const auto box_reference = [](auto offset_of, auto byte_of) {
    return [=](NodeLayout layout) { return row_reference(offset_of, byte_of, row_scene(layout).box_type())(layout); };
  };
  std::vector<BadCase> cases{
      {E::kBadReference, "box reference to half a node", box_reference(root, node(0, 64)), float_planes},
      {E::kBadReference, "box reference to a leaf", box_reference(child(0, 2), leaf(0))},
      {E::kBadReference, "leaf reference to a node", row_reference(child(0, 0), node(0), 0)},
      {E::kBadReference, "to the header", row_with(child(0, 0), 0u)},
      {E::kBadReference, "behind the end", row_with(child(0, 0), 0xfffffff8u)},
      {E::kBadReference, "the leaf section's end", row_reference(child(0, 0), leaf(4), 0)},
      {E::kBadReference, "a box node of another layout",
       [=](NodeLayout layout) { return row_reference(root, node(0), 9 - row_scene(layout).box_type())(layout); }},
      {E::kReferenceOrder, "itself", box_reference(child(1, 1), node(1))},
      {E::kReferenceOrder, "a loop to the root", box_reference(child(1, 1), node(0))},
      {E::kBadReference, "between two sections", row_reference(child(1, 1), at_byte(320), 0)},
  };
  for (const unsigned type : {1u, 2u, 3u, 4u, 5u, 6u})
    cases.push_back({E::kBadReference, "type 1 to 6", row_reference(child(0, 0), leaf(0), type)});
  return cases;
}

std::vector<BadCase> reachability_cases() {
  using E = FormatError;
  const auto child = [](unsigned node, unsigned slot) {
    return [=](const TestScene& scene) { return scene.child_at(node, slot); };
  };
  return {
      {E::kUnterminatedRun, "last leaf without the bit",
       row_changed([](TestScene& s) { s.leaves[3].last = false; }, child(1, 3))},
      {E::kUnterminatedRun, "last leaf without the bit, and the bit set behind the section",
       row_changed(
           [](TestScene& s) {
             s.leaves[3].last = false;
             // The map follows the leaves. Its word 14 is where a leaf's flags would be.
             s.map.resize(16, kInvalidId);
             s.geometries.push_back({8, 8, 8, 0xffffffffu, 0});
           },
           child(1, 3))},
      {E::kSharedNode, "a run goes into another",
       row_changed([](TestScene& s) { s.leaves[2].last = false; }, child(1, 3))},
      {E::kSharedNode, "two references to one leaf",
       row_changed(
           [](TestScene& s) {
             s.nodes[1][3].index = 2;
             s.nodes[1][3].box = row_box(2, 2);
           },
           child(1, 3))},
      {E::kSharedNode, "two references to one node",
       row_changed([](TestScene& s) { s.nodes[0][3] = s.nodes[0][2]; }, child(0, 3))},
      {E::kEmptyNode, "no children",
       row_changed([](TestScene& s) { s.nodes[1] = {}; }, [](const TestScene& s) { return s.node_at(1); })},
      {E::kUnreachable, "a leaf",
       row_changed([](TestScene& s) { s.nodes[1][3] = {}; }, [](const TestScene& s) { return s.leaf_at(3); })},
      {E::kUnreachable, "a node",
       row_changed([](TestScene& s) { s.nodes.push_back(s.nodes[1]); },
                   [](const TestScene& s) { return s.node_at(2); })},
      {E::kUnreachable, "the first node: the root is another",
       row_changed(
           [](TestScene& s) {
             s.root.index = 1;
             s.root.box = row_box(2, 3);
           },
           [](const TestScene& s) { return s.node_at(0); })},
      {E::kUnreachable, "everything: no root",
       row_changed([](TestScene& s) { s.root = {}; }, [](const TestScene& s) { return s.node_at(0); })},
  };
}

std::vector<BadCase> box_cases() {
  using E = FormatError;
  const auto plane = [](unsigned node, unsigned child, unsigned side, unsigned axis) {
    return [=](const TestScene& scene) { return scene.plane_at(node, child, side, axis); };
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  return {
      {E::kBadBox, "NaN", row_with(plane(1, 1, 0, 1), nan), float_planes},
      {E::kBadBox, "infinite", row_with(plane(1, 3, 1, 2), kInf), float_planes},
      {E::kBadBox, "inverted", row_changed([](TestScene& s) { s.nodes[1][1].box.min[0] = 6; }, plane(1, 1, 0, 0))},
      {E::kBadBox, "absent child, finite plane", row_with(plane(0, 1, 1, 1), 0.0f), float_planes},
      {E::kBadBox, "absent child, NaN", row_with(plane(0, 3, 0, 0), nan), float_planes},
      {E::kBadBox, "present child, empty box",
       row_changed([](TestScene& s) { s.nodes[1][1].box = kEmpty; }, plane(1, 1, 0, 0)),
       [](NodeLayout layout) { return layout != NodeLayout::kQuantized; }},
      {E::kBoxNotContained, "child box leaves the parent's, below",
       row_changed([](TestScene& s) { s.nodes[1][1].box.min[0] = 3.5f; }, plane(1, 1, 0, 0))},
      {E::kBoxNotContained, "child box leaves the parent's, above",
       row_changed([](TestScene& s) { s.nodes[1][3].box.max[1] = 1.0625f; }, plane(1, 3, 1, 1))},
      {E::kBoxNotContained, "child box leaves the parent's by one bit",
       row_with(plane(1, 3, 1, 1), std::nextafter(1.0f, 2.0f)), float_planes},
      {E::kBoxNotContained, "triangle leaves the box",
       row_changed([](TestScene& s) { s.leaves[3].vertex[0][0] = std::nextafter(6.0f, 5.0f); },
                   [](const TestScene& s) { return s.vertex_at(3, 0, 0); })},
      {E::kBoxNotContained, "fourth vertex leaves the box",
       row_changed([](TestScene& s) { s.leaves[3].vertex[3][2] = -1e-30f; },
                   [](const TestScene& s) { return s.vertex_at(3, 3, 2); })},
      {E::kBoxNotContained, "triangle leaves the bounds of a root leaf",
       changed(
           root_leaf_scene, [](TestScene& s) { s.root.box.max[1] = 0.5f; },
           [](const TestScene& s) { return s.vertex_at(0, 2, 1); })},
  };
}

std::vector<BadCase> bounds_and_node_field_cases() {
  using E = FormatError;
  const auto flags = [](unsigned node, unsigned child) {
    return [=](const TestScene& scene) { return scene.flags_at(node, child); };
  };
  const auto last_word = [](const TestScene& s) { return s.node_at(1) + s.node_size() - 4; };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  return {
      {E::kBadBounds, "too large", row_header_with(56 + 16, 2.0f)},
      {E::kBadBounds, "too small", row_header_with(56, 0.5f)},
      {E::kBadBounds, "NaN", row_header_with(56 + 20, nan)},
      {E::kBadBounds, "infinite", row_header_with(56 + 12, kInf)},
      {E::kBadBounds, "inverted", row_header_with(56, 9.0f)},
      {E::kBadBounds, "not empty", [](NodeLayout layout) { return patched(empty_scene(layout), 56 + 4, 0.0f); }},
      {E::kBadReservedField, "node", row_with(last_word, 1u), not_half},
      {E::kBadChildFlags, "none", row_with(flags(0, 0), std::uint8_t{0}), not_half},
      {E::kBadChildFlags, "only procedural", row_with(flags(1, 3), std::uint8_t{8}), not_half},
      {E::kBadChildFlags, "of an absent child", row_with(flags(0, 1), std::uint8_t{5}), not_half},
  };
}

std::vector<BadCase> leaf_cases() {
  using E = FormatError;
  const auto info = [](unsigned leaf, unsigned field) {
    return [=](const TestScene& scene) { return scene.leaf_at(leaf) + 48 + field; };
  };
  const auto vertex = [](unsigned leaf, unsigned number, unsigned axis) {
    return [=](const TestScene& scene) { return scene.vertex_at(leaf, number, axis); };
  };
  return {
      {E::kBadVertex, "NaN", row_with(vertex(1, 0, 2), std::numeric_limits<float>::quiet_NaN())},
      {E::kBadVertex, "infinite", row_with(vertex(3, 3, 1), -kInf)},
      {E::kBadVertex, "v3 of a single triangle", row_with(vertex(2, 3, 0), 4.5f)},
      {E::kBadVertex, "v3 of a single triangle, sign of zero", row_with(vertex(2, 3, 2), -0.0f)},
      {E::kBadGeometryId, "2 of 2", row_with(info(0, 8), 2u)},
      {E::kBadGeometryId, "largest", row_with(info(0, 8), 0x0fffffffu)},
      {E::kBadGeometryId, "triangles of a custom geometry",
       row_changed([](TestScene& s) { s.geometries[1].flags = 0x0101; },
                   [](const TestScene& s) { return s.leaf_at(3) + 48 + 8; })},
      {E::kBadReservedField, "bit 28", row_with(info(0, 8), 0x10000000u)},
      {E::kBadPrimitiveId, "6 of 6", row_with(info(0, 0), 6u)},
      {E::kBadPrimitiveId, "first triangle absent", row_with(info(0, 0), kInvalidId)},
      {E::kBadPrimitiveId, "2 of 2, triangle 1", row_with(info(3, 4), 2u)},
      {E::kBadTriangleId, "u and v of one corner", row_with(info(0, 12), std::uint8_t{0x85})},
      {E::kBadTriangleId, "mirrored", row_with(info(0, 12), std::uint8_t{0x86})},
      {E::kBadTriangleId, "not opaque", row_with(info(0, 13), std::uint8_t{0x09})},
      {E::kBadTriangleId, "flipped", row_with(info(0, 13), std::uint8_t{0xa9})},
      {E::kBadTriangleId, "of an absent triangle", row_with(info(2, 13), std::uint8_t{0x89})},
      {E::kBadReservedField, "triangle-id byte 2", row_with(info(1, 14), std::uint8_t{1})},
      {E::kBadReservedField, "triangle-id byte 3",
       [](NodeLayout layout) {
         const TestScene scene = row_scene(layout);
         return BadFile{patched(scene, scene.leaf_at(1) + 48 + 15, std::uint8_t{1}).file, scene.leaf_at(1) + 48 + 14};
       }},
      {E::kSplitWithoutFeature, "in two leaves", row_with(info(1, 0), 0u)},
      {E::kSplitWithoutFeature, "twice in a leaf", row_with(info(1, 4), 2u)},
  };
}

std::function<BadFile(NodeLayout)> split_changed(const std::function<void(TestScene&)>& change,
                                                 const std::function<std::uint64_t(const TestScene&)>& offset_of) {
  return changed(split_scene, change, offset_of);
}

std::vector<BadCase> split_cases() {
  using E = FormatError;
  return {
      {E::kSplitWithoutFeature, "bit not set",
       split_changed(
           [](TestScene& s) {
             s.features = 1;
             s.nodes[0][0].box = s.nodes[0][1].box = s.root.box;
           },
           [](const TestScene& s) { return s.leaf_at(1) + 48; })},
      {E::kSplitNotCovered, "a side is missing",
       split_changed([](TestScene& s) { s.nodes[0][0].box.min[0] = s.root.box.min[0] = 0.5f; },
                     [](const TestScene& s) { return s.leaf_at(0) + 48; })},
      {E::kSplitNotCovered, "all boxes beside the triangle",
       split_changed(
           [](TestScene& s) {
             for (Box* box : {&s.nodes[0][0].box, &s.nodes[0][1].box, &s.root.box}) box->min[2] = box->max[2] = 1;
           },
           [](const TestScene& s) { return s.leaf_at(0) + 48; })},
      {E::kSplitNotCovered, "one box beside the triangle, which does not cover what both boxes enclose",
       split_changed(
           [](TestScene& s) {
             s.nodes[0][0].box.min[0] = s.root.box.min[0] = -3;
             s.nodes[0][0].box.max[0] = -1;
           },
           [](const TestScene& s) { return s.leaf_at(0) + 48; })},
      {E::kSplitDiffers, "another vertex",
       split_changed([](TestScene& s) { s.leaves[1].vertex[0][0] = 3; },
                     [](const TestScene& s) { return s.leaf_at(1); })},
      {E::kSplitDiffers, "another rotation",
       split_changed([](TestScene& s) { s.leaves[1].id[0] = 0x82; }, [](const TestScene& s) { return s.leaf_at(1); })},
      {E::kPrimitiveMapMismatch, "of a split primitive",
       split_changed([](TestScene& s) { s.map[0] = 4; }, [](const TestScene& s) { return s.map_at(); })},
      {E::kBoxNotContained, "whole primitive in a file with splits",
       row_changed(
           [](TestScene& s) {
             s.features |= 4;
             s.leaves[3].vertex[1][0] = 7.5f;
           },
           [](const TestScene& s) { return s.vertex_at(3, 1, 0); })},
  };
}

}  // namespace

std::vector<BadCase> content_cases() {
  std::vector<BadCase> all;
  for (auto* part :
       {reference_cases, reachability_cases, box_cases, bounds_and_node_field_cases, leaf_cases, split_cases})
    for (BadCase& bad : part()) all.push_back(std::move(bad));
  return all;
}

}  // namespace hiprt::test
