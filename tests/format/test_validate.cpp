/// Valid files pass with the right counts. Every FormatError occurs, at the byte with the fault.

#include "bad_files.h"
#include "good_parts.h"
#include "safe_walk.h"
#include "shape_files.h"

#include <hiprt_build/format/validate.h>

#include <tests/catch.h>

#include <set>

using namespace hiprt;
using namespace hiprt::test;

namespace {

std::vector<BadCase> all_cases() {
  std::vector<BadCase> all = container_cases();
  for (auto* part : {content_cases, encoding_cases, custom_cases, instance_cases, motion_cases, part_and_still_cases,
                     one_motion_fault_cases, shape_cases})
    for (BadCase& bad : part()) all.push_back(std::move(bad));
  return all;
}

NodeLayout every_layout() { return GENERATE(from_range(std::begin(kAllLayouts), std::end(kAllLayouts))); }

}  // namespace

TEST_CASE("good files pass and are counted") {
  const NodeLayout layout = every_layout();
  const auto row = validate(row_scene(layout).write().bytes());
  REQUIRE(row);
  CHECK(row->nodes == 2);
  CHECK(row->leaves == 4);
  CHECK(row->leaf_runs == 3);
  CHECK(row->leaf_triangles == 7);
  CHECK(row->primitives == 8);
  CHECK(row->dropped == 1);
  CHECK(row->split == 0);
  CHECK(row->depth == 2);
  CHECK(row->stack_need == 2);

  const auto split = validate(split_scene(layout).write().bytes());
  REQUIRE(split);
  CHECK(split->split == 1);
  CHECK(split->leaf_triangles == 2);
  CHECK(split->primitives == 1);

  const auto leaf = validate(root_leaf_scene(layout).write().bytes());
  REQUIRE(leaf);
  CHECK(leaf->depth == 0);
  CHECK(leaf->leaf_runs == 1);

  const auto empty = validate(empty_scene(layout).write().bytes());
  REQUIRE(empty);
  CHECK(empty->dropped == 1);
  CHECK(empty->leaves == 0);
}

TEST_CASE("good files with custom primitives pass and are counted") {
  const NodeLayout layout = every_layout();
  const auto custom = validate(custom_scene(layout).write().bytes());
  REQUIRE(custom);
  CHECK(custom->leaf_triangles == 2);
  CHECK(custom->leaf_customs == 5);
  CHECK(custom->leaf_runs == 3);
  CHECK(custom->dropped == 1);

  const auto custom_root = validate(custom_root_scene(layout).write().bytes());
  REQUIRE(custom_root);
  CHECK(custom_root->leaf_triangles == 0);
  CHECK(custom_root->leaf_customs == 1);
}

TEST_CASE("good files with shapes pass, and every shape is at its offset") {
  const NodeLayout layout = every_layout();
  const TestFile file = shape_file(layout);
  const auto summary = validate(file.bytes());
  INFO((summary ? "" : to_string(summary.error())));
  REQUIRE(summary);
  CHECK(summary->shape_points == 22);
  CHECK(summary->dropped == 2);
  const BufferView view = *open_buffer(file.bytes());
  REQUIRE(view.shapes.size() == 5);
  CHECK(view.shapes[0].kind == ShapeKind::kNone);
  CHECK(view.shapes[1].kind == ShapeKind::kSpheres);
  CHECK(view.shapes[2].kind == ShapeKind::kCurves);
  CHECK(view.shapes[3].kind == ShapeKind::kNone);
  CHECK(view.shapes[4].kind == ShapeKind::kMovingTriangles);
  CHECK(view.segments_of(4).size() == 6);
  REQUIRE(view.points_of(1).size() == 3);
  CHECK(view.points_of(1)[1].position[0] == 6);
  CHECK(view.points_of(1)[1].radius == 0.5f);
  REQUIRE(view.points_of(2).size() == 7);
  CHECK(view.points_of(2)[3].position[1] == 4);
  const auto segments = view.segments_of(2);
  CHECK(std::vector(segments.begin(), segments.end()) == std::vector<std::uint32_t>{0, 1, 3, 5});
  CHECK(view.points_of(0).empty());
  CHECK(view.points_of(3).empty());
  CHECK(view.segments_of(1).empty());

  const TestFile scene = shape_scene_file(layout);
  const auto whole = validate(scene.bytes());
  INFO((whole ? "" : to_string(whole.error())));
  REQUIRE(whole);
  const BufferView top = *open_buffer(scene.bytes());
  REQUIRE(top.object_shapes.size() == 2);
  CHECK(top.object_shapes[0] == 0);
  CHECK(top.object_shapes[1] == open_buffer(top.object_file(top.objects[1]))->shape_entry.offset);
}

TEST_CASE("a scene's table of its objects' shapes may be missing: older builders write none") {
  TestFile scene = shape_scene_file(NodeLayout::kPlanes);
  const BufferView view = *open_buffer(scene.bytes());
  for (std::uint32_t i = 0; i < view.header->section_count; ++i) {
    const std::uint64_t at = sizeof(FileHeader) + i * sizeof(SectionEntry);
    if (scene.get<std::uint32_t>(at) == static_cast<std::uint32_t>(SectionKind::kObjectShapes)) scene.put(at, 4711u);
  }
  scene.seal();
  CHECK(validate(scene.bytes()));
  CHECK(open_buffer(scene.bytes())->object_shapes.empty());
}

TEST_CASE("half planes may be infinite where coordinates are beyond the largest half") {
  const TestFile file = far_scene().write();
  const auto result = validate(file.bytes());
  INFO((result ? "" : to_string(result.error())));
  CHECK(result);
}

TEST_CASE("files of version 1.0 are accepted") {
  const NodeLayout layout = GENERATE(NodeLayout::kFloat, NodeLayout::kPlanes);
  TestScene scene = row_scene(layout);
  for (const std::uint16_t minor : {std::uint16_t{0}, std::uint16_t{1}}) {
    scene.version_minor = minor;
    CHECK(validate(scene.write().bytes()));
  }
}

TEST_CASE("variations that the format allows are accepted") {
  const NodeLayout layout = every_layout();
  TestScene scene = row_scene(layout);
  SECTION("the split feature without a split") { scene.features |= 4; }
  SECTION("a larger stack bound") { scene.stack_bound = 6; }
  SECTION("boxes larger than their content") { scene.nodes[0][2].box.min[0] = 0; }
  SECTION("the opaque bit alone where both kinds of leaves are below") { scene = custom_scene(layout); }
  SECTION("no provenance") { scene.provenance.clear(); }
  SECTION("white space around the provenance") { scene.provenance = "\n { } \t"; }
  TestFile file = scene.write();
  SECTION("an unknown optional section") {
    TestScene with_unknown = row_scene(layout);
    file = with_unknown.write();
    file.put(TestScene::entry_at(4), SectionEntry{4711, 0, with_unknown.provenance_at(), 9, 5});
  }
  SECTION("unknown section flags") { file.put(TestScene::entry_at(0) + 4, 0xfffffffeu); }
  SECTION("a newer minor version") { file.put<std::uint16_t>(10, 7); }
  file.seal();
  const auto result = validate(file.bytes());
  INFO((result ? "" : to_string(result.error())));
  CHECK(result);
}

TEST_CASE("instances in parts, down to the deepest level, are accepted") {
  const NodeLayout layout = every_layout();
  const TestScene row = row_scene(layout), chain = chain_scene(layout, kMostOpenedLevels + 2);
  for (const TestFile& file : {opened_file(row, {root_of(row)}), opened_file(row, {run_of(row, 0), node_of(row, 1)}),
                               opened_file(row, {run_of(row, 3), run_of(row, 2), run_of(row, 0)}),
                               opened_file(chain, chain_parts(chain, kMostOpenedLevels))}) {
    const auto result = validate(file.bytes());
    INFO((result ? "" : to_string(result.error())));
    REQUIRE(result);
    CHECK(result->dropped + 1 == result->primitives);
  }
}

TEST_CASE("motions of every kind, also hidden at keys, and scenes without leaves are accepted") {
  const NodeLayout layout = every_layout();
  const TestFile nothing = empty_scene(layout).write();
  for (const TestFile& file : {slerp_file(layout), nlerp_file(layout), matrix_file(layout), hidden_first_file(layout),
                               hidden_last_file(layout), hidden_twice_file(layout), sliding_file(layout),
                               sliding_back_file(layout), scene_of({nothing.bytes()}, {{}})}) {
    const auto result = validate(file.bytes());
    INFO((result ? "" : to_string(result.error())));
    REQUIRE(result);
  }
}

TEST_CASE("bounds of transforms may be smaller by the last bits of another compiler's doubles") {
  TestFile file = instances_of(row_scene(every_layout()), 2);
  const FileHeader& header = *open_buffer(file.bytes())->header;
  file.put(offsetof(FileHeader, condition), (1 - 0x1p-22f) * header.condition);
  file.put(offsetof(FileHeader, reach), (1 - 0x1p-22f) * header.reach);
  file.seal();
  CHECK(validate(file.bytes()));
}

TEST_CASE("a sphere or a segment of a curve without radius may be in a leaf") {
  TestFile file = shape_file(every_layout());
  const BufferView view = *open_buffer(file.bytes());
  for (const std::uint64_t at : {view.shapes[1].points, view.shapes[2].points + 3 * sizeof(ShapePoint),
                                 view.shapes[2].points + 4 * sizeof(ShapePoint)})
    file.put(at + offsetof(ShapePoint, radius), 0.0f);
  file.seal();
  const auto result = validate(file.bytes());
  INFO((result ? "" : to_string(result.error())));
  CHECK(result);
}

TEST_CASE("each fault is reported with its name and offset") {
  const NodeLayout layout = every_layout();
  for (const BadCase& bad : all_cases()) {
    if (!bad.applies(layout)) continue;
    const BadFile made = bad.make(layout);
    const auto result = validate(made.file.bytes());
    INFO(name(bad.error) << ": " << bad.what << ", layout " << static_cast<unsigned>(layout));
    REQUIRE_FALSE(result);
    INFO(to_string(result.error()));
    CHECK(name(result.error().error) == std::string(name(bad.error)));
    CHECK(result.error().offset == made.offset);
  }
}

TEST_CASE("misaligned and truncated bytes are refused") {
  const TestFile file = row_scene(every_layout()).write();
  TestFile shifted(std::vector<std::byte>(file.size() + 64));
  std::memcpy(shifted.data() + 64, file.data(), file.size());
  const auto misaligned = validate(shifted.bytes().subspan(64));
  REQUIRE_FALSE(misaligned);
  CHECK(misaligned.error().error == FormatError::kMisaligned);
  CHECK(misaligned.error().value == 64);
  const auto small = validate(file.bytes().first(127));
  REQUIRE_FALSE(small);
  CHECK(small.error().error == FormatError::kTooSmall);
  CHECK(small.error().value == 127);
  const auto none = validate({});
  REQUIRE_FALSE(none);
  CHECK(none.error().error == FormatError::kTooSmall);
}

TEST_CASE("there is a test for every FormatError") {
  std::set<FormatError> produced{FormatError::kMisaligned, FormatError::kTooSmall};  // the test above
  for (const BadCase& bad : all_cases()) produced.insert(bad.error);
  for (std::size_t e = 0; e < kFormatErrors; ++e) {
    INFO(name(static_cast<FormatError>(e)));
    CHECK(produced.count(static_cast<FormatError>(e)) == 1);
  }
}

TEST_CASE("the independent walk of the bit-flip test detects files that would harm a traversal") {
  const NodeLayout layout = every_layout();
  CHECK(walk_problem(row_scene(layout).write().bytes()) == "");
  CHECK(walk_problem(custom_scene(layout).write().bytes()) == "");
  const std::set<FormatError> harmful{FormatError::kBadReference,    FormatError::kReferenceOrder,
                                      FormatError::kUnterminatedRun, FormatError::kBadGeometryId,
                                      FormatError::kBadPrimitiveId,  FormatError::kBadChildSlots};
  for (const BadCase& bad : all_cases()) {
    if (!bad.applies(layout)) continue;
    INFO(name(bad.error) << ": " << bad.what);
    if (harmful.count(bad.error) != 0) CHECK(walk_problem(bad.make(layout).file.bytes()) != "");
  }
}

TEST_CASE("reports read well") {
  const BadFile bad = patched(row_scene(NodeLayout::kFloat), 52, 3u);
  const auto result = validate(bad.file.bytes());
  REQUIRE_FALSE(result);
  CHECK(to_string(result.error()) ==
        "3 geometries; expected 2 (a scene of instances has one custom geometry of type 0 that every ray sees) "
        "(byte 52, GeometryCount)");
}
