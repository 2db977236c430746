#include <hiprt_build/format/check.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/format/widened_boxes.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace hiprt {

using namespace format_detail;

namespace {

/// A section kind that this version knows, with its record size.
struct KnownSection {
  SectionKind kind;
  std::uint64_t stride;  ///< 0: node_size() of the file's layout.
  bool mandatory;
  SectionEntry BufferView::*entry;
};
constexpr std::array<KnownSection, 14> kKnownSections{{
    {SectionKind::kNodes, 0, true, &BufferView::nodes},
    {SectionKind::kLeaves, sizeof(FloatLeaf), true, &BufferView::leaves},
    {SectionKind::kPrimitiveMap, sizeof(std::uint32_t), true, &BufferView::primitive_map_entry},
    {SectionKind::kGeometries, sizeof(GeometryRecord), true, &BufferView::geometry_entry},
    {SectionKind::kProvenance, 1, false, &BufferView::provenance_entry},
    {SectionKind::kInstances, sizeof(InstanceRecord), false, &BufferView::instance_entry},
    {SectionKind::kObjects, sizeof(ObjectRecord), false, &BufferView::object_entry},
    {SectionKind::kObjectFiles, 1, false, &BufferView::object_file_entry},
    {SectionKind::kMotions, sizeof(MotionRecord), false, &BufferView::motion_entry},
    {SectionKind::kMotionSegments, sizeof(MotionSegment), false, &BufferView::segment_entry},
    {SectionKind::kShapes, sizeof(ShapeRecord), false, &BufferView::shape_entry},
    {SectionKind::kShapePoints, sizeof(ShapePoint), false, &BufferView::shape_point_entry},
    {SectionKind::kCurveSegments, sizeof(std::uint32_t), false, &BufferView::curve_segment_entry},
    {SectionKind::kObjectShapes, sizeof(std::uint64_t), false, &BufferView::object_shape_entry},
}};

tl::expected<void, FormatIssue> check_header(std::span<const std::byte> bytes) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kSectionAlignment != 0)
    return fail(FormatError::kMisaligned, 0, reinterpret_cast<std::uintptr_t>(bytes.data()) % kSectionAlignment, 0);
  if (bytes.size() < sizeof(FileHeader)) return fail(FormatError::kTooSmall, 0, bytes.size(), sizeof(FileHeader));
  const auto& header = *reinterpret_cast<const FileHeader*>(bytes.data());
  if (std::memcmp(header.magic, kMagic, sizeof(kMagic)) != 0)
    return fail(FormatError::kBadMagic, 0, static_cast<unsigned char>(header.magic[0]),
                static_cast<unsigned char>(kMagic[0]));
  if (header.version_major != kVersionMajor)
    return fail(FormatError::kUnknownMajorVersion, 8, header.version_major, kVersionMajor);
  const auto layout = static_cast<NodeLayout>(header.layout);
  if (layout < NodeLayout::kFloat || layout > NodeLayout::kQuantized)
    return fail(FormatError::kUnknownLayout, 12, header.layout, static_cast<std::uint32_t>(NodeLayout::kQuantized));
  if ((header.features & ~kKnownFeatures) != 0)
    return fail(FormatError::kUnknownFeature, 16, header.features, kKnownFeatures);
  if (header.byte_size != bytes.size()) return fail(FormatError::kSizeMismatch, 24, header.byte_size, bytes.size());
  for (std::uint64_t i = 0; i < std::size(header.reserved); ++i)
    if (header.reserved[i] != 0)
      return fail(FormatError::kBadReservedField, offsetof(FileHeader, reserved) + 4 * i, header.reserved[i], 0);
  const std::uint64_t capacity =
      std::min<std::uint64_t>(kMaxSections, (bytes.size() - sizeof(FileHeader)) / sizeof(SectionEntry));
  if (header.section_count > capacity) return fail(FormatError::kSectionTableRange, 40, header.section_count, capacity);
  return {};
}

/// Checks the range of a section in the file, without overflow.
/// @param table_end the first byte behind the section table.
tl::expected<void, FormatIssue> check_range(const SectionEntry& entry, std::uint64_t at, std::uint64_t table_end,
                                            std::uint64_t size) {
  if (entry.offset % kSectionAlignment != 0)
    return fail(FormatError::kSectionMisaligned, at + 8, entry.offset, kSectionAlignment);
  if (entry.stride == 0) return fail(FormatError::kSectionStride, at + 24, 0, 1);
  if (entry.offset > size) return fail(FormatError::kSectionRange, at + 8, entry.offset, size);
  if (entry.count > (size - entry.offset) / entry.stride)
    return fail(FormatError::kSectionRange, at + 16, entry.count, (size - entry.offset) / entry.stride);
  if (entry.offset < table_end) return fail(FormatError::kSectionOverlap, at + 8, entry.offset, table_end);
  return {};
}

bool overlap(const SectionEntry& a, const SectionEntry& b) {
  const std::uint64_t a_size = a.count * a.stride, b_size = b.count * b.stride;
  return a_size != 0 && b_size != 0 && a.offset < b.offset + b_size && b.offset < a.offset + a_size;
}

tl::expected<void, FormatIssue> check_stride(const BufferView& view, const KnownSection& known,
                                             const SectionEntry& entry, std::uint64_t at) {
  const std::uint64_t stride = known.stride != 0 ? known.stride : node_size(view.layout());
  if (entry.stride == stride) return {};
  const NodePlaces places(entry, view.layout());
  const std::uint64_t nodes = known.kind == SectionKind::kNodes ? places.nodes(entry) : 0;
  if (!places.has_gaps() || entry.stride != places.stride(nodes))
    return fail(FormatError::kSectionStride, at + 24, entry.stride, stride);
  // A gap does not end the section, and nothing else is as small.
  if (entry.count != places.count(nodes))
    return fail(FormatError::kSectionRange, at + 16, entry.count, places.count(nodes));
  return {};
}

/// Stores @p entry under its kind in @p view.
/// @param seen bit i: kKnownSections[i] was found before.
tl::expected<void, FormatIssue> assign(BufferView& view, const SectionEntry& entry, std::uint64_t at,
                                       std::uint32_t& seen) {
  for (std::size_t k = 0; k < kKnownSections.size(); ++k) {
    if (entry.kind != static_cast<std::uint32_t>(kKnownSections[k].kind)) continue;
    if ((seen >> k & 1u) != 0) return fail(FormatError::kDuplicateSection, at, entry.kind, 1);
    if (auto stride = check_stride(view, kKnownSections[k], entry, at); !stride) return stride;
    seen |= 1u << k;
    view.*kKnownSections[k].entry = entry;
    return {};
  }
  if ((entry.flags & kSectionRequired) != 0) return fail(FormatError::kUnknownRequiredSection, at, entry.kind, 0);
  return {};
}

tl::expected<void, FormatIssue> check_geometries(const BufferView& view) {
  const FileHeader& header = *view.header;
  if (header.geometry_count != view.geometries.size() || view.geometries.size() > kMaxGeometries)
    return fail(FormatError::kGeometryCount, 52, header.geometry_count, view.geometries.size());
  if (header.primitive_count != view.primitive_map.size())
    return fail(FormatError::kPrimitiveCount, 80, header.primitive_count, view.primitive_map.size());
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < view.geometries.size(); ++i) {
    const GeometryRecord& geometry = view.geometries[i];
    const std::uint64_t at = view.geometry_entry.offset + i * sizeof(GeometryRecord);
    if (geometry.first_primitive != next) return fail(FormatError::kPrimitiveCount, at, geometry.first_primitive, next);
    if (geometry.primitive_count > header.primitive_count - next || geometry.primitive_count >= kInvalidId)
      return fail(FormatError::kPrimitiveCount, at + 8, geometry.primitive_count, header.primitive_count - next);
    constexpr std::uint32_t known = custom_geometry_flags(kMaxGeometryType);
    if ((geometry.flags & ~known) != 0) return fail(FormatError::kBadReservedField, at + 28, geometry.flags, known);
    next += geometry.primitive_count;
  }
  if (next != header.primitive_count) return fail(FormatError::kPrimitiveCount, 80, header.primitive_count, next);
  return {};
}

/// Checks that a header without instances has no feature that needs them.
tl::expected<void, FormatIssue> check_instance_features(const BufferView& view) {
  const FileHeader& header = *view.header;
  const std::uint32_t instances = feature_bit(Feature::kInstances);
  if (((header.features & instances) != 0) != view.has_instances())
    return fail(FormatError::kFeatureMismatch, offsetof(FileHeader, features), header.features,
                header.features ^ instances);
  if (view.has_instances()) return {};
  for (const Feature feature : {Feature::kMotion, Feature::kMovingBoxes})
    if ((header.features & feature_bit(feature)) != 0)
      return fail(FormatError::kFeatureMismatch, offsetof(FileHeader, features), header.features,
                  header.features & ~feature_bit(feature));
  return {};
}

/// Checks that the header has a shutter if boxes move, and else zeros.
tl::expected<void, FormatIssue> check_shutter(const FileHeader& header) {
  const bool moving_boxes = (header.features & feature_bit(Feature::kMovingBoxes)) != 0;
  if (moving_boxes ? !std::isfinite(header.shutter_begin) : header.shutter_begin != 0.0f)
    return fail_float(FormatError::kBadMotion, offsetof(FileHeader, shutter_begin), header.shutter_begin, 0.0f);
  if (moving_boxes ? !(header.shutter_rate >= 0x1p-100f && header.shutter_rate <= 0x1p100f)
                   : header.shutter_rate != 0.0f)
    return fail_float(FormatError::kBadMotion, offsetof(FileHeader, shutter_rate), header.shutter_rate, 0.0f);
  return {};
}

/// Checks that the header has a margin if boxes are widened, and else zero. Layouts planes and quantized have none, and
/// trees over instances have none.
tl::expected<void, FormatIssue> check_box_margin(const BufferView& view) {
  const FileHeader& header = *view.header;
  const FeatureMask widened = feature_bit(Feature::kWidenedBoxes);
  const bool has = (header.features & widened) != 0;
  if (has && (view.has_instances() || !may_be_widened(view.layout())))
    return fail(FormatError::kFeatureMismatch, offsetof(FileHeader, features), header.features,
                header.features & ~widened);
  if (has ? header.box_margin > 0.0f && std::isfinite(header.box_margin) : header.box_margin == 0.0f) return {};
  return fail_float(FormatError::kBadBoxMargin, offsetof(FileHeader, box_margin), header.box_margin, 0.0f);
}

/// Checks that the header has the levels and bounds of transforms if there are instances, and else zeros.
tl::expected<void, FormatIssue> check_transform_bounds(const FileHeader& header, bool instances) {
  if ((header.levels != 0) != instances)
    return fail(FormatError::kBadLevels, offsetof(FileHeader, levels), header.levels, instances ? 1 : 0);
  if (instances ? !(header.condition >= 1.0f && header.condition <= kMaxCondition) : header.condition != 0.0f)
    return fail_float(FormatError::kBadTransformBound, offsetof(FileHeader, condition), header.condition,
                      instances ? 1.0f : 0.0f);
  if (instances ? !(header.reach >= 0.0f && header.reach <= std::numeric_limits<float>::max()) : header.reach != 0.0f)
    return fail_float(FormatError::kBadTransformBound, offsetof(FileHeader, reach), header.reach, 0.0f);
  return {};
}

/// Checks that the objects' files lie in their section, one behind the other. The file of an object may be without
/// objects: its instances are of the objects of the scene's file.
tl::expected<void, FormatIssue> check_object_files(const BufferView& view) {
  const bool objects = view.object_entry.kind != 0;
  if (objects != (view.object_file_entry.kind != 0) || (objects && !view.has_instances()))
    return fail(FormatError::kMissingSection, 40, static_cast<std::uint64_t>(SectionKind::kObjects), 1);
  std::uint64_t free = view.object_file_entry.offset;
  const std::uint64_t end = free + view.object_file_entry.count;
  for (const ObjectRecord& object : view.objects) {
    const auto at = static_cast<std::uint64_t>(reinterpret_cast<const std::byte*>(&object) - view.bytes.data());
    if (object.offset % kBufferAlignment != 0) return fail(FormatError::kBadObject, at, object.offset, free);
    if (object.offset < free || object.offset > end)
      return fail(FormatError::kBadObject, at, object.offset, object.offset < free ? free : end);
    if (object.size > end - object.offset)
      return fail(FormatError::kBadObject, at + offsetof(ObjectRecord, size), object.size, end - object.offset);
    free = object.offset + object.size;
  }
  return {};
}

/// Checks that kInstances, its sections and its header fields are all there, or none of them.
tl::expected<void, FormatIssue> check_instance_sections(const BufferView& view) {
  if (auto features = check_instance_features(view); !features) return features;
  if (auto shutter = check_shutter(*view.header); !shutter) return shutter;
  if (auto margin = check_box_margin(view); !margin) return margin;
  if (auto bounds = check_transform_bounds(*view.header, view.has_instances()); !bounds) return bounds;
  return check_object_files(view);
}

/// Checks that there are both sections of motion or none, a record per instance, and that its segments lie in the
/// section. kMotion may be set for the motion of an object.
tl::expected<void, FormatIssue> check_motion_sections(const BufferView& view) {
  const bool motions = view.motion_entry.kind != 0;
  if (motions != (view.segment_entry.kind != 0) || (motions && !view.has_instances()))
    return fail(FormatError::kMissingSection, 40, static_cast<std::uint64_t>(SectionKind::kMotions), 1);
  if (!motions) return {};
  if (view.motions.size() != view.instances.size())
    return fail(FormatError::kBadMotion, view.motion_entry.offset, view.motions.size(), view.instances.size());
  const std::uint64_t begin = view.segment_entry.offset, end = begin + view.segments.size_bytes();
  for (const MotionRecord& motion : view.motions) {
    const auto at = static_cast<std::uint64_t>(reinterpret_cast<const std::byte*>(&motion) - view.bytes.data());
    if (motion.count == 0) {
      if (motion.segments != 0) return fail(FormatError::kBadMotion, at, motion.segments, 0);
      continue;
    }
    if (motion.segments < begin || motion.segments > end || (motion.segments - begin) % sizeof(MotionSegment) != 0)
      return fail(FormatError::kBadMotion, at, motion.segments, begin);
    if (motion.count > (end - motion.segments) / sizeof(MotionSegment))
      return fail(FormatError::kBadMotion, at + offsetof(MotionRecord, count), motion.count,
                  (end - motion.segments) / sizeof(MotionSegment));
  }
  return {};
}

/// Checks that @p count records at @p offset lie in a section.
/// @return kBadShape at the wrong field.
tl::expected<void, FormatIssue> check_shape_range(const SectionEntry& section, std::uint64_t offset,
                                                  std::uint64_t offset_at, std::uint64_t count,
                                                  std::uint64_t count_at) {
  const std::uint64_t end = section.offset + section.count * section.stride;
  if (offset < section.offset || offset > end || (offset - section.offset) % section.stride != 0)
    return fail(FormatError::kBadShape, offset_at, offset, section.offset);
  const std::uint64_t capacity = (end - offset) / section.stride;
  if (count > capacity) return fail(FormatError::kBadShape, count_at, count, capacity);
  return {};
}

/// Checks the record of one geometry. Only custom geometries have shapes, in their sections, as many as primitives.
tl::expected<void, FormatIssue> check_shape_record(const BufferView& view, std::size_t i) {
  const ShapeRecord& shape = view.shapes[i];
  const GeometryRecord& geometry = view.geometries[i];
  const std::uint64_t at = view.shape_entry.offset + i * sizeof(ShapeRecord);
  const std::uint64_t count_at = at + offsetof(ShapeRecord, point_count);
  if (shape.reserved != 0)
    return fail(FormatError::kBadReservedField, at + offsetof(ShapeRecord, reserved), shape.reserved, 0);
  const bool custom = (geometry.flags & kGeometryCustom) != 0;
  if (shape.kind > ShapeKind::kMovingTriangles || (shape.kind != ShapeKind::kNone && !custom))
    return fail(FormatError::kBadShape, at + offsetof(ShapeRecord, kind), static_cast<std::uint32_t>(shape.kind),
                custom ? static_cast<std::uint32_t>(ShapeKind::kMovingTriangles) : 0);
  const bool moves = shape.kind == ShapeKind::kMovingTriangles;
  if (moves ? shape.keys < 2 : shape.keys != 0)
    return fail(FormatError::kBadShape, at + offsetof(ShapeRecord, keys), shape.keys, moves ? 2 : 0);
  if (shape.kind == ShapeKind::kNone && shape.points != 0) return fail(FormatError::kBadShape, at, shape.points, 0);
  if (shape.kind == ShapeKind::kNone && shape.point_count != 0)
    return fail(FormatError::kBadShape, count_at, shape.point_count, 0);
  const std::uint64_t numbers = segment_numbers(shape.kind), segments_at = at + offsetof(ShapeRecord, segments);
  if (numbers == 0 && shape.segments != 0) return fail(FormatError::kBadShape, segments_at, shape.segments, 0);
  if (shape.kind == ShapeKind::kNone) return {};
  if (auto range = check_shape_range(view.shape_point_entry, shape.points, at, shape.point_count, count_at); !range)
    return range;
  if (moves && shape.point_count % shape.keys != 0)
    return fail(FormatError::kBadShape, count_at, shape.point_count, shape.point_count / shape.keys * shape.keys);
  if (numbers != 0)
    return check_shape_range(view.curve_segment_entry, shape.segments, segments_at, numbers * geometry.primitive_count,
                             segments_at);
  if (shape.point_count == geometry.primitive_count) return {};
  return fail(FormatError::kBadShape, count_at, shape.point_count, geometry.primitive_count);
}

/// Checks that there are all three sections of shapes or none, and a record per geometry. A scene of instances has an
/// offset per object instead.
tl::expected<void, FormatIssue> check_shape_sections(const BufferView& view) {
  const bool shapes = view.shape_entry.kind != 0;
  if (shapes != (view.shape_point_entry.kind != 0) || shapes != (view.curve_segment_entry.kind != 0) ||
      (shapes && view.has_instances()))
    return fail(FormatError::kMissingSection, 40, static_cast<std::uint64_t>(SectionKind::kShapes), 1);
  if (view.object_shape_entry.kind != 0 && view.object_entry.kind == 0)
    return fail(FormatError::kMissingSection, 40, static_cast<std::uint64_t>(SectionKind::kObjects), 1);
  if (view.object_shape_entry.kind != 0 && view.object_shapes.size() != view.objects.size())
    return fail(FormatError::kBadShape, view.object_shape_entry.offset, view.object_shapes.size(), view.objects.size());
  if (!shapes) return {};
  if (view.shapes.size() != view.geometries.size())
    return fail(FormatError::kBadShape, view.shape_entry.offset, view.shapes.size(), view.geometries.size());
  for (std::size_t i = 0; i < view.shapes.size(); ++i)
    if (auto good = check_shape_record(view, i); !good) return good;
  return {};
}

}  // namespace

tl::expected<BufferView, FormatIssue> open_buffer(std::span<const std::byte> bytes) {
  if (auto header = check_header(bytes); !header) return tl::unexpected(header.error());
  BufferView view;
  view.bytes = bytes;
  view.header = reinterpret_cast<const FileHeader*>(bytes.data());
  const std::span<const SectionEntry> table{reinterpret_cast<const SectionEntry*>(bytes.data() + sizeof(FileHeader)),
                                            view.header->section_count};
  const std::uint64_t table_end = sizeof(FileHeader) + table.size_bytes();
  std::uint32_t seen = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::uint64_t at = sizeof(FileHeader) + i * sizeof(SectionEntry);
    if (auto range = check_range(table[i], at, table_end, bytes.size()); !range) return tl::unexpected(range.error());
    for (std::size_t j = 0; j < i; ++j)
      if (overlap(table[i], table[j]))
        return fail(FormatError::kSectionOverlap, at + 8, table[i].offset, table[j].offset);
    if (auto assigned = assign(view, table[i], at, seen); !assigned) return tl::unexpected(assigned.error());
  }
  for (std::size_t k = 0; k < kKnownSections.size(); ++k)
    if (kKnownSections[k].mandatory && (seen >> k & 1u) == 0)
      return fail(FormatError::kMissingSection, 40, static_cast<std::uint64_t>(kKnownSections[k].kind), 1);
  view.primitive_map = view.records<std::uint32_t>(view.primitive_map_entry);
  view.geometries = view.records<GeometryRecord>(view.geometry_entry);
  const std::span<const char> text = view.records<char>(view.provenance_entry);
  view.provenance = {text.data(), text.size()};
  view.instances = view.records<InstanceRecord>(view.instance_entry);
  view.objects = view.records<ObjectRecord>(view.object_entry);
  view.motions = view.records<MotionRecord>(view.motion_entry);
  view.segments = view.records<MotionSegment>(view.segment_entry);
  view.shapes = view.records<ShapeRecord>(view.shape_entry);
  view.shape_points = view.records<ShapePoint>(view.shape_point_entry);
  view.curve_segments = view.records<std::uint32_t>(view.curve_segment_entry);
  view.object_shapes = view.records<std::uint64_t>(view.object_shape_entry);
  for (const auto check : {check_geometries, check_instance_sections, check_motion_sections, check_shape_sections})
    if (auto good = check(view); !good) return tl::unexpected(good.error());
  return view;
}

SceneView make_scene_view(const BufferView& view, const std::byte* device_base) {
  const std::byte* base = device_base != nullptr ? device_base : view.bytes.data();
  SceneView scene;
  scene.base = base;
  scene.size = view.bytes.size();
  scene.geometries = reinterpret_cast<const GeometryRecord*>(base + view.geometry_entry.offset);
  scene.root = view.header->root;
  scene.stack_bound = view.header->stack_bound;
  scene.features = view.header->features;
  scene.layout = view.layout();
  scene.bounds = view.header->bounds;
  scene.box_margin = view.header->box_margin;
  scene.shapes = view.has_instances() ? view.object_shape_entry.offset : view.shape_entry.offset;
  if (!view.has_instances()) return scene;
  scene.instances = reinterpret_cast<const InstanceRecord*>(base + view.instance_entry.offset);
  scene.objects = reinterpret_cast<const ObjectRecord*>(base + view.object_entry.offset);
  if (!view.motions.empty()) scene.motions = reinterpret_cast<const MotionRecord*>(base + view.motion_entry.offset);
  scene.levels = view.header->levels;
  scene.condition = view.header->condition;
  scene.reach = view.header->reach;
  scene.shutter_begin = view.header->shutter_begin;
  scene.shutter_rate = view.header->shutter_rate;
  return scene;
}

}  // namespace hiprt
