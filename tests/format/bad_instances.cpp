// Invalid scenes of instances, one fault each. A scene has two objects (a triangle pair, and a group of one instance of
// it) and one instance of each object.

#include "bad_files.h"

#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>

#include <stdexcept>

namespace hiprt::test {

namespace {

TestFile scene_file(NodeLayout layout) {
  const TestFile object = root_leaf_scene(layout).write();
  const std::span<const std::byte> files[] = {object.bytes()};
  const std::vector<build::Instance> inner{{}},
      outer{{.object = 0, .to_scene = {{{2, 0, 0, 1}, {0, 1, 0, 0}, {0, 0, 1, 0}}}}, {.object = 1, .mask = 1, .id = 7}};
  const std::span<const build::Instance> groups[] = {inner, outer};
  const auto scene = build::build_instances(build::InstancedScene{files, groups});
  if (!scene) throw std::runtime_error(scene.error().message);
  return TestFile(scene->buffer.bytes());
}

/// One object and two instances of it: the first stands still, the second moves through three keys.
TestFile moving_file(NodeLayout layout) {
  const TestFile object = root_leaf_scene(layout).write();
  const std::span<const std::byte> files[] = {object.bytes()};
  const build::Motion motion{.keys = {{.time = 0, .translation = {1, 2, 3}},
                                      {.time = 1, .rotation = {0, 0, 1, 1}},
                                      {.time = 3, .rotation = {1, 0, 0, 1}}}};
  const std::vector<build::Instance> group{{}, {.motion = &motion}};
  const auto scene = build::build_instances(files, group);
  if (!scene) throw std::runtime_error(scene.error().message);
  return TestFile(scene->buffer.bytes());
}

/// Where a field lies. @param object: in that object's file; -1: in the scene's.
using OffsetOf = std::uint64_t (*)(const BufferView&);
std::uint64_t header(const BufferView&) { return 0; }
std::uint64_t instances(const BufferView& view) { return view.instance_entry.offset; }
std::uint64_t objects(const BufferView& view) { return view.object_entry.offset; }
std::uint64_t leaves(const BufferView& view) { return view.leaves.offset; }
std::uint64_t moving(const BufferView& view) { return view.motion_entry.offset + sizeof(MotionRecord); }
std::uint64_t segments(const BufferView& view) { return view.segment_entry.offset; }

/// A scene that moves with a group that does not, whose file has these fields.
auto moving_file_with_group(float shutter_begin, float shutter_rate, FeatureMask moving_boxes) {
  return [=](NodeLayout layout) {
    const TestFile object = root_leaf_scene(layout).write();
    const std::span<const std::byte> files[] = {object.bytes()};
    const build::Motion motion{.keys = {{.time = 0}, {.time = 1, .translation = {1, 2, 3}}}};
    const std::vector<build::Instance> inner{{}}, outer{{.object = 1, .motion = &motion}};
    const std::span<const build::Instance> groups[] = {inner, outer};
    const auto scene = build::build_instances(build::InstancedScene{files, groups});
    if (!scene) throw std::runtime_error(scene.error().message);
    TestFile file(scene->buffer.bytes());
    const BufferView view = *open_buffer(file.bytes());
    TestFile group(view.object_file(view.objects[1]));
    const FeatureMask features =
        (open_buffer(group.bytes())->header->features & ~feature_bit(Feature::kMovingBoxes)) | moving_boxes;
    group.put(offsetof(FileHeader, features), features);
    group.put(offsetof(FileHeader, shutter_begin), shutter_begin);
    group.put(offsetof(FileHeader, shutter_rate), shutter_rate);
    if (moving_boxes == 0)
      group.put(leaves(*open_buffer(group.bytes())) + sizeof(Box), Box{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}});
    group.seal();
    std::memcpy(file.data() + view.objects[1].offset, group.data(), group.size());
    file.put(view.object_entry.offset + sizeof(ObjectRecord) + offsetof(ObjectRecord, features), features);
    file.seal();
    return BadFile{std::move(file), offsetof(FileHeader, shutter_begin)};
  };
}

template <class T>
BadCase wrong(FormatError error, const char* what, OffsetOf section, std::uint64_t field, T value,
              TestFile (*good)(NodeLayout) = scene_file) {
  return {error, what, [=](NodeLayout layout) {
            TestFile file = good(layout);
            const std::uint64_t at = section(*open_buffer(file.bytes())) + field;
            BadFile bad{std::move(file), at};
            bad.file.put(at, value);
            bad.file.seal();
            return bad;
          }};
}

/// The same in the file of object 1, whose checksum is right again too.
template <class T>
BadCase wrong_inside(FormatError error, const char* what, OffsetOf section, std::uint64_t field, T value) {
  return {error, what, [=](NodeLayout layout) {
            TestFile file = scene_file(layout);
            const BufferView view = *open_buffer(file.bytes());
            const std::uint64_t begin = view.objects[1].offset;
            TestFile object(view.object_file(view.objects[1]));
            const std::uint64_t at = section(*open_buffer(object.bytes())) + field;
            object.put(at, value);
            object.seal();
            std::memcpy(file.data() + begin, object.data(), object.size());
            file.seal();
            return BadFile{std::move(file), begin + at};
          }};
}

}  // namespace

std::vector<BadCase> instance_cases() {
  using E = FormatError;
  constexpr std::uint64_t kEntryNode = offsetof(CustomLeaf, info) + 4;
  const std::uint64_t features = offsetof(FileHeader, features), levels = offsetof(FileHeader, levels);
  const std::uint64_t condition = offsetof(FileHeader, condition), reach = offsetof(FileHeader, reach);
  return {
      wrong(E::kFeatureMismatch, "instances without their bit", header, features, std::uint64_t{3}),
      wrong(E::kFeatureMismatch, "not what objects have", header, features, std::uint64_t{0x1b}),
      wrong(E::kFeatureMismatch, "no masks", header, features, std::uint64_t{0x11}),
      {E::kFeatureMismatch, "the bit without instances", row_header_with<std::uint64_t>(features, 16 | 3)},
      wrong(E::kBadLevels, "none", header, levels, 0u),
      wrong(E::kBadLevels, "one less", header, levels, 1u),
      {E::kBadLevels, "without instances", row_header_with(levels, 1u)},
      wrong(E::kBadTransformBound, "a condition below what is needed", header, condition, 1.5f),
      wrong(E::kBadTransformBound, "a condition below 1", header, condition, 0.5f),
      wrong(E::kBadTransformBound, "a NaN condition", header, condition, std::numeric_limits<float>::quiet_NaN()),
      wrong(E::kBadTransformBound, "reach 0", header, reach, 0.0f),
      wrong(E::kBadTransformBound, "an infinite reach", header, reach, kInf),
      {E::kBadTransformBound, "a condition without instances", row_header_with(condition, 1.0f)},
      {E::kBadTransformBound, "a reach without instances", row_header_with(reach, 1.0f)},
      wrong(E::kStackBound, "too low", header, offsetof(FileHeader, stack_bound), 2u),
      wrong(E::kBadObject, "a reserved word", objects, offsetof(ObjectRecord, reserved), 1u),
      wrong(E::kBadObject, "odd offset", objects, offsetof(ObjectRecord, offset), std::uint64_t{255}),
      wrong(E::kBadObject, "outside", objects, offsetof(ObjectRecord, offset), std::uint64_t{1} << 40),
      wrong(E::kBadObject, "too large", objects, offsetof(ObjectRecord, size), ~std::uint64_t{0}),
      wrong(E::kBadObject, "another root", objects, offsetof(ObjectRecord, root), 8u),
      wrong(E::kBadInstance, "of no object", instances, offsetof(InstanceRecord, object), 2u),
      wrong(E::kBadInstance, "an entry node outside", leaves, kEntryNode, 0x10000000u),
      wrong(E::kBadInstance, "no entry node", leaves, kEntryNode, kInvalidRef),
      wrong(E::kBadInstance, "an entry node of the wrong kind", leaves, kEntryNode, 0x36u),
      wrong(E::kBadReservedField, "an unknown flag", instances, offsetof(InstanceRecord, flags), 2u),
      wrong(E::kBadInstance, "an infinite row", instances, 8, kInf),
      wrong(E::kBadInstance, "a NaN translation", instances, 36, std::numeric_limits<float>::quiet_NaN()),
      wrong(E::kBadInstance, "no inverse", instances, 0, 0.0f),
      wrong_inside(E::kBadInstance, "of itself", instances, offsetof(InstanceRecord, object), 1u),
      wrong(E::kInstanceLeaf, "more than one in a run", leaves, offsetof(CustomLeaf, info) + 8, 0u),
      wrong_inside(E::kBadLevels, "inside", header, levels, 2u),
  };
}

std::vector<BadCase> motion_cases() {
  using E = FormatError;
  const auto at_record = [](const char* what, std::uint64_t field, auto value, FormatError error = E::kBadMotion) {
    return wrong(error, what, moving, field, value, moving_file);
  };
  const auto in_segment = [](const char* what, std::uint64_t word, float value, unsigned segment = 0) {
    return wrong(E::kBadMotion, what, segments, segment * sizeof(MotionSegment) + 4 * word, value, moving_file);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  return {
      wrong(E::kFeatureMismatch, "motion without its bit", header, offsetof(FileHeader, features), std::uint64_t{0x51},
            moving_file),
      {E::kFeatureMismatch, "the bit of motion without instances",
       row_header_with<std::uint64_t>(offsetof(FileHeader, features), 32 | 3)},
      wrong(E::kBadTransformBound, "a condition without the motion's rounding", header, offsetof(FileHeader, condition),
            2.0f, moving_file),
      at_record("segments before the section", 0, std::uint64_t{0}),
      at_record("segments behind the section", 0, std::uint64_t{1} << 40),
      at_record("too many segments", offsetof(MotionRecord, count), 3u),
      at_record("no kind", offsetof(MotionRecord, kind), 0u),
      at_record("an unknown kind", offsetof(MotionRecord, kind), 4u),
      at_record("less rounding than there is", offsetof(MotionRecord, rounding), 1.0f),
      at_record("NaN rounding", offsetof(MotionRecord, rounding), nan),
      at_record("less far than it goes", offsetof(MotionRecord, farthest), 3.0f),
      at_record("a reserved word", offsetof(MotionRecord, reserved), 1u, E::kBadReservedField),
      in_segment("times in the wrong order", 1, -1.0f),
      in_segment("a gap between segments", 0, 1.5f, 1),
      in_segment("an infinite time", 1, kInf, 1),
      in_segment("a NaN translation", 2, nan),
      in_segment("a quaternion too long", 8, 0.1f),
      in_segment("an arc not at a right angle", 12, -0.7f, 1),
      in_segment("an angle too large", 16, 1.6f),
      in_segment("a negative angle", 16, -0.1f),
      in_segment("no scale", 23, 0.0f),
      in_segment("a scale that changes its sign", 24, -1.0f),
      in_segment("a reserved number", 29, 1.0f),
      wrong(E::kBadMotion, "a scale too small", segments, 4 * 17, 1e-8f, moving_file),
      wrong(E::kBoxNotContained, "a box that it leaves", leaves, 12, 0.5f, moving_file),
      wrong(E::kBadBox, "a NaN box at the end", leaves, 24 + 8, nan, moving_file),
      {E::kBoxNotContained, "a box that it leaves at the end",
       [](NodeLayout layout) {
         TestFile file = moving_file(layout);
         const std::uint64_t at = leaves(*open_buffer(file.bytes())) + 12;
         file.put(at + 24, 0.5f);
         file.seal();
         return BadFile{std::move(file), at};
       }},
      {E::kFeatureMismatch, "moving boxes without instances",
       row_header_with<std::uint64_t>(offsetof(FileHeader, features), 64 | 3)},
      {E::kBadMotion, "a shutter without moving boxes", row_header_with(offsetof(FileHeader, shutter_rate), 1.0f)},
      {E::kBadMotion, "a shutter's begin without moving boxes",
       row_header_with(offsetof(FileHeader, shutter_begin), 1.0f)},
      wrong(E::kBadMotion, "a shutter of no length", header, offsetof(FileHeader, shutter_rate), kInf, moving_file),
      wrong(E::kBadMotion, "a shutter without end", header, offsetof(FileHeader, shutter_rate), 0.0f, moving_file),
      wrong(E::kBadMotion, "a shutter without begin", header, offsetof(FileHeader, shutter_begin), nan, moving_file),
      wrong(E::kBadMotion, "a shutter that ends before the keys", header, offsetof(FileHeader, shutter_rate), 1.0f,
            moving_file),
      wrong(E::kBadMotion, "a shutter that begins behind the first key", header, offsetof(FileHeader, shutter_begin),
            0.5f, moving_file),
      {E::kBadMotion, "an object without moving boxes", moving_file_with_group(0.0f, 0.0f, 0)},
      {E::kBadMotion, "an object whose shutter begins at another time",
       moving_file_with_group(0.25f, 1.0f, feature_bit(Feature::kMovingBoxes))},
      {E::kBadMotion, "an object whose shutter has another length",
       moving_file_with_group(0.0f, 0.25f, feature_bit(Feature::kMovingBoxes))},
  };
}

}  // namespace hiprt::test
