// Invalid files with shapes, one fault each.

#include "bad_files.h"
#include "shape_files.h"

#include <hiprt_build/format/view.h>

#include <limits>

namespace hiprt::test {

namespace {

using SectionOffset = std::uint64_t (*)(const BufferView&);
std::uint64_t records(const BufferView& view) { return view.shape_entry.offset; }
std::uint64_t points(const BufferView& view) { return view.shape_point_entry.offset; }
std::uint64_t segments(const BufferView& view) { return view.curve_segment_entry.offset; }
std::uint64_t object_shapes(const BufferView& view) { return view.object_shape_entry.offset; }
/// The record of geometry 1, of spheres, 2, of curves, and 3, of none.
std::uint64_t spheres(const BufferView& view) { return records(view) + sizeof(ShapeRecord); }
std::uint64_t curves(const BufferView& view) { return records(view) + 2 * sizeof(ShapeRecord); }
std::uint64_t moving_points(const BufferView& view) { return view.shapes[4].points; }
/// The record of geometry 4, of moving triangles.
std::uint64_t moving(const BufferView& view) { return records(view) + 4 * sizeof(ShapeRecord); }
std::uint64_t none(const BufferView& view) { return records(view) + 3 * sizeof(ShapeRecord); }

/// @param value of the good file's view.
template <class Value>
BadCase wrong(FormatError error, const char* what, SectionOffset section, std::uint64_t field, Value value,
              TestFile (*good)(NodeLayout) = shape_file) {
  return {error, what, [=](NodeLayout layout) {
            TestFile file = good(layout);
            const BufferView view = *open_buffer(file.bytes());
            const std::uint64_t at = section(view) + field;
            const auto written = value(view);
            BadFile bad{std::move(file), at};
            bad.file.put(at, written);
            bad.file.seal();
            return bad;
          }};
}

template <class T> auto constant(T value) {
  return [value](const BufferView&) { return value; };
}

/// A section's entry in the table.
std::uint64_t entry_at(const BufferView& view, SectionKind kind) {
  for (std::uint32_t i = 0; i < view.header->section_count; ++i) {
    const std::uint64_t at = sizeof(FileHeader) + i * sizeof(SectionEntry);
    if (reinterpret_cast<const SectionEntry*>(view.bytes.data() + at)->kind == static_cast<std::uint32_t>(kind))
      return at;
  }
  return 0;
}

/// A good file in which the section of @p kind gets an unknown kind, so that the section is missing.
BadCase without(SectionKind kind, const char* what, TestFile (*good)(NodeLayout)) {
  return {FormatError::kMissingSection, what, [=](NodeLayout layout) {
            BadFile bad{good(layout), 40};
            const std::uint64_t at = entry_at(*open_buffer(bad.file.bytes()), kind);
            bad.file.put(at, 4711u);
            bad.file.put(at + 4, 0u);
            bad.file.seal();
            return bad;
          }};
}

/// One element less in a section.
BadCase shorter(SectionKind kind, const char* what, SectionOffset section, TestFile (*good)(NodeLayout)) {
  return {FormatError::kBadShape, what, [=](NodeLayout layout) {
            TestFile file = good(layout);
            const BufferView view = *open_buffer(file.bytes());
            BadFile bad{std::move(file), section(view)};
            const std::uint64_t at = entry_at(view, kind) + offsetof(SectionEntry, count);
            bad.file.put(at, bad.file.get<std::uint64_t>(at) - 1);
            bad.file.seal();
            return bad;
          }};
}

/// Segments of curves in shape_file(), before the corners of its moving triangles.
constexpr std::uint64_t kSegments = 4;

std::vector<BadCase> record_cases() {
  using E = FormatError;
  const std::uint64_t first = offsetof(ShapeRecord, points), count = offsetof(ShapeRecord, point_count);
  const std::uint64_t keys = offsetof(ShapeRecord, keys);
  const std::uint64_t kind = offsetof(ShapeRecord, kind), numbers = offsetof(ShapeRecord, segments);
  const auto end_of = [](SectionEntry BufferView::*entry) {
    return
        [entry](const BufferView& view) { return (view.*entry).offset + (view.*entry).count * (view.*entry).stride; };
  };
  return {
      wrong(E::kBadShape, "a triangle mesh of spheres", records, kind, constant(1u)),
      wrong(E::kBadShape, "an unknown kind", spheres, kind, constant(4u)),
      wrong(E::kBadShape, "keys of spheres", spheres, keys, constant(2u)),
      wrong(E::kBadShape, "keys of curves", curves, keys, constant(1u)),
      wrong(E::kBadShape, "keys of no shapes", none, keys, constant(2u)),
      wrong(E::kBadShape, "a single key", moving, keys, constant(1u)),
      wrong(E::kBadShape, "no key", moving, keys, constant(0u)),
      wrong(E::kBadShape, "keys that do not divide the points", moving, count, constant(11u)),
      wrong(E::kBadShape, "corners behind their section", moving, numbers,
            [](const BufferView& view) { return view.shapes[4].segments + 4; }),
      wrong(E::kBadShape, "points of no shapes", none, first, constant(std::uint64_t{128})),
      wrong(E::kBadShape, "a count of no shapes", none, count, constant(1u)),
      wrong(E::kBadShape, "segments of spheres", spheres, numbers, constant(std::uint64_t{128})),
      wrong(E::kBadShape, "points before their section", spheres, first, constant(std::uint64_t{128})),
      wrong(E::kBadShape, "points behind their section", spheres, first, constant(~std::uint64_t{0} - 15)),
      wrong(E::kBadShape, "points between two", spheres, first,
            [](const BufferView& view) { return view.shape_point_entry.offset + 8; }),
      wrong(E::kBadShape, "a point too many", curves, count, constant(20u)),
      wrong(E::kBadShape, "fewer spheres than primitives", spheres, count, constant(2u)),
      wrong(E::kBadShape, "more spheres than primitives", spheres, count, constant(4u)),
      wrong(E::kBadShape, "segments behind their section", curves, numbers, end_of(&BufferView::curve_segment_entry)),
      wrong(E::kBadShape, "segments between two", curves, numbers,
            [](const BufferView& view) { return view.curve_segment_entry.offset + 2; }),
      wrong(E::kBadReservedField, "a reserved word", curves, offsetof(ShapeRecord, reserved), constant(1u)),
  };
}

}  // namespace

std::vector<BadCase> shape_cases() {
  using E = FormatError;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  std::vector<BadCase> cases = record_cases();
  for (const BadCase& bad : {
           wrong(E::kBadShape, "a NaN coordinate", points, 4, constant(kNan)),
           wrong(E::kBadShape, "an infinite coordinate", points, 16 + 8, constant(kInf)),
           wrong(E::kBadShape, "a negative radius", points, 12, constant(-1.0f)),
           wrong(E::kBadShape, "a NaN radius", points, 9 * 16 + 12, constant(kNan)),
           wrong(E::kBadShape, "a segment from the last point", segments, 8, constant(6u)),
           wrong(E::kBadShape, "a segment from nowhere", segments, 0, constant(0xffffffffu)),
           wrong(E::kBadShape, "a corner behind the vertices of a key", segments, (kSegments + 5) * 4, constant(4u)),
           wrong(E::kBadShape, "a vertex at another time than its key", moving_points, 5 * 16 + 12, constant(0.5f)),
           wrong(E::kBadShape, "a key that is not later", moving_points, 4 * 16 + 12, constant(0.0f)),
           wrong(E::kBadShape, "a time that is not finite", moving_points, 8 * 16 + 12, constant(kInf)),
           without(SectionKind::kShapePoints, "shapes without points", shape_file),
           without(SectionKind::kShapes, "points without shapes", shape_file),
           without(SectionKind::kCurveSegments, "shapes without segments", shape_file),
           shorter(SectionKind::kShapes, "a geometry without a record", records, shape_file),
           shorter(SectionKind::kObjectShapes, "an object without a number", object_shapes, shape_scene_file),
           wrong(E::kBadShape, "an object's shapes elsewhere", object_shapes, 8, constant(std::uint64_t{128}),
                 shape_scene_file),
           wrong(E::kBadShape, "shapes of an object that has none", object_shapes, 0, constant(std::uint64_t{128}),
                 shape_scene_file),
       })
    cases.push_back(bad);
  // A sphere that has grown out of its box: the report names the box's plane.
  cases.push_back({E::kBoxNotContained, "a sphere larger than its box", [](NodeLayout layout) {
                     TestFile file = shape_file(layout);
                     const BufferView view = *open_buffer(file.bytes());
                     const std::uint32_t entry = view.primitive_map[1];
                     BadFile bad{std::move(file), view.leaves.offset + entry / 2 * sizeof(CustomLeaf) +
                                                      offsetof(CustomLeaf, box) + entry % 2 * sizeof(Box)};
                     bad.file.put(points(view) + offsetof(ShapePoint, radius), 1.5f);
                     bad.file.seal();
                     return bad;
                   }});
  cases.push_back({E::kBoxNotContained, "a curve that has left its box", [](NodeLayout layout) {
                     TestFile file = shape_file(layout);
                     const BufferView view = *open_buffer(file.bytes());
                     const std::uint32_t entry = view.primitive_map[4];
                     BadFile bad{std::move(file), view.leaves.offset + entry / 2 * sizeof(CustomLeaf) +
                                                      offsetof(CustomLeaf, box) + entry % 2 * sizeof(Box) + 4};
                     bad.file.put(points(view) + 3 * sizeof(ShapePoint) + 4, 2.0f);
                     bad.file.seal();
                     return bad;
                   }});
  // Triangle 0 has vertices 0, 1 and 2; triangle 1 has 0, 2 and 3.
  for (const std::uint32_t triangle : {0u, 1u})
    cases.push_back({E::kBoxNotContained, "a triangle that leaves its box at the last key", [=](NodeLayout layout) {
                       TestFile file = shape_file(layout);
                       const BufferView view = *open_buffer(file.bytes());
                       const std::uint32_t entry = view.primitive_map[view.geometries[4].first_primitive + triangle];
                       BadFile bad{std::move(file), view.leaves.offset + entry / 2 * sizeof(CustomLeaf) +
                                                        offsetof(CustomLeaf, box) + entry % 2 * sizeof(Box) + 20};
                       const std::uint32_t vertex = 8 + (triangle == 0 ? 1 : 3);
                       bad.file.put(view.shapes[4].points + vertex * sizeof(ShapePoint) + 8, 3.5f);
                       bad.file.seal();
                       return bad;
                     }});
  return cases;
}

}  // namespace hiprt::test
