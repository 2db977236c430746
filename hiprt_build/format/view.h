#pragma once
/// Typed view of a BVH file in memory. Header and section table are checked, content is trusted. Host only.
///
/// For bytes of unknown origin call validate() (validate.h) instead, which checks everything.

#include <hiprt_build/export.h>
#include <hiprt_build/format/dispatch_layout.h>
#include <hiprt_build/format/error.h>
#include <hiprt_build/format/node_places.h>
#include <hiprt_device/format/buffer.h>
#include <hiprt_device/format/instance.h>
#include <hiprt_device/format/layout.h>
#include <hiprt_device/format/motion.h>
#include <hiprt_device/format/shape.h>
#include <hiprt_device/scene_view.h>

#include <tl/expected.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace hiprt {

/// The sections of a file. Spans point into the bytes of the file and live as long as these.
struct BufferView {
  std::span<const std::byte> bytes;
  const FileHeader* header = nullptr;
  SectionEntry nodes{}, leaves{}, primitive_map_entry{}, geometry_entry{}, provenance_entry{};
  SectionEntry instance_entry{}, object_entry{}, object_file_entry{}, motion_entry{}, segment_entry{};
  SectionEntry shape_entry{}, shape_point_entry{}, curve_segment_entry{}, object_shape_entry{};
  std::span<const std::uint32_t> primitive_map;
  std::span<const GeometryRecord> geometries;
  std::string_view provenance;                    ///< Empty if the file has none.
  std::span<const InstanceRecord> instances;      ///< Empty if the file has none.
  std::span<const ObjectRecord> objects;          ///< Empty if the file has none.
  std::span<const MotionRecord> motions;          ///< Empty if none of its instances moves.
  std::span<const MotionSegment> segments;        ///< Of all motions.
  std::span<const ShapeRecord> shapes;            ///< Empty if the file does not define its custom primitives.
  std::span<const ShapePoint> shape_points;       ///< Of all shapes.
  std::span<const std::uint32_t> curve_segments;  ///< Of all curves and moving triangles.
  std::span<const std::uint64_t> object_shapes;   ///< Per object the offset of its shapes; empty if no object has
                                                  ///< shapes.

  bool has_instances() const { return instance_entry.kind != 0; }
  bool has_moving_boxes() const { return (header->features & feature_bit(Feature::kMovingBoxes)) != 0; }
  /// Segments of an instance; empty if it stands still.
  /// @pre open_buffer() accepted the file.
  std::span<const MotionSegment> motion_of(std::size_t instance) const {
    if (motions.empty() || motions[instance].count == 0) return {};
    const std::uint64_t first = (motions[instance].segments - segment_entry.offset) / sizeof(MotionSegment);
    return segments.subspan(static_cast<std::size_t>(first), motions[instance].count);
  }
  /// Points of a geometry; empty if it has no shapes.
  /// @pre open_buffer() accepted the file.
  std::span<const ShapePoint> points_of(std::size_t geometry) const {
    if (shapes.empty() || shapes[geometry].kind == ShapeKind::kNone) return {};
    const std::uint64_t first = (shapes[geometry].points - shape_point_entry.offset) / sizeof(ShapePoint);
    return shape_points.subspan(static_cast<std::size_t>(first), shapes[geometry].point_count);
  }
  /// First points of a geometry's segments, or the corners of its moving triangles; empty unless it has these.
  /// @pre open_buffer() accepted the file.
  std::span<const std::uint32_t> segments_of(std::size_t geometry) const {
    const std::size_t per_primitive = shapes.empty() ? 0 : segment_numbers(shapes[geometry].kind);
    if (per_primitive == 0) return {};
    const std::uint64_t first = (shapes[geometry].segments - curve_segment_entry.offset) / sizeof(std::uint32_t);
    return curve_segments.subspan(static_cast<std::size_t>(first),
                                  per_primitive * static_cast<std::size_t>(geometries[geometry].primitive_count));
  }
  /// The file of an object.
  /// @pre open_buffer() accepted this file.
  std::span<const std::byte> object_file(const ObjectRecord& object) const {
    return bytes.subspan(static_cast<std::size_t>(object.offset), static_cast<std::size_t>(object.size));
  }
  /// Number of box nodes.
  std::uint64_t node_count() const { return node_places().nodes(nodes); }
  NodePlaces node_places() const { return {nodes, layout()}; }
  /// The number of a box node. @pre open_buffer() accepted the file, and the node lies in it.
  std::uint64_t node_number(NodeRef ref) const { return node_places().number(ref_offset(ref) - nodes.offset); }
  /// Whether a box node begins where the reference says, whatever its type.
  bool has_node(NodeRef ref) const {
    const std::uint64_t offset = ref_offset(ref);
    return offset >= nodes.offset && node_places().is_node(offset - nodes.offset, node_count());
  }
  /// @tparam Node of the file's layout.
  template <class Node> NodeArray<const Node> node_array() const {
    return {bytes.data() + nodes.offset, node_places()};
  }
  NodeLayout layout() const { return static_cast<NodeLayout>(header->layout); }
  /// @tparam Record the record type of the file's layout (Node or Leaf of layout.h).
  template <class Record> std::span<const Record> records(const SectionEntry& section) const {
    return {reinterpret_cast<const Record*>(bytes.data() + section.offset), static_cast<std::size_t>(section.count)};
  }
};

/// Checks header, section table and geometry table, in time proportional to their sizes.
/// @param bytes the whole file, aligned to 128 bytes (mapped, or read into an aligned buffer).
/// @return the view, or the first fault. Never reads outside @p bytes.
HIPRT_BUILD_API tl::expected<BufferView, FormatIssue> open_buffer(std::span<const std::byte> bytes);

/// The part of the file that a tracer needs.
/// @param view of a file accepted by validate() or open_buffer(); from open_buffer() alone the content is trusted.
/// @param device_base address of a copy of the file in the memory of the processor that traces, aligned to 256 bytes.
/// nullptr: the file is traced where it is.
HIPRT_BUILD_API SceneView make_scene_view(const BufferView& view, const std::byte* device_base = nullptr);

}  // namespace hiprt
