#pragma once
/// The part of validate() that looks at instances and their objects. Host only.

#include <hiprt_device/format/instance_bounds.h>

#include <array>
#include <bit>
#include <cmath>
#include <span>

namespace hiprt::format_detail {

/// Every leaf holds one instance and is alone in its run.
inline Check check_instance_leaves(const BufferView& view) {
  if (!view.has_instances()) return {};
  const auto leaves = view.records<CustomLeaf>(view.leaves);
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    const LeafInfo& info = leaves[i].info;
    if (info.primitive[1] != kInvalidId || (info.geometry_and_flags & kLastInRun) == 0)
      return fail(FormatError::kInstanceLeaf,
                  view.leaves.offset + i * sizeof(CustomLeaf) + offsetof(CustomLeaf, info) + 4, info.primitive[1],
                  kInvalidId);
  }
  return {};
}

/// Instances of a file whose tree and leaves have been checked.
/// @tparam Layout of the file and of all objects.
template <class Layout> class InstanceCheck {
 public:
  /// @param objects that the instances may name, all of them good.
  InstanceCheck(const BufferView& view, std::span<const BufferView> objects, std::span<const ObjectRecord> records)
      : view_(view), objects_(objects), records_(records) {}

  /// @param stack_need of the file's own tree. @return that of a traversal with all objects.
  tl::expected<std::uint32_t, FormatIssue> run(std::uint32_t stack_need) {
    if (view_.geometries.size() != 1 || view_.geometries[0].flags != custom_geometry_flags(0) ||
        view_.geometries[0].mask != 0xffffffffu)
      return fail(FormatError::kGeometryCount, view_.geometry_entry.offset, view_.geometries.size(), 1);
    if (view_.geometries[0].primitive_count != view_.instances.size())
      return fail(FormatError::kPrimitiveCount, view_.geometry_entry.offset + 8, view_.geometries[0].primitive_count,
                  view_.instances.size());
    const auto leaves = view_.records<CustomLeaf>(view_.leaves);
    for (std::size_t i = 0; i < leaves.size(); ++i)
      if (auto leaf = check_leaf(leaves[i], view_.leaves.offset + i * sizeof(CustomLeaf)); !leaf)
        return tl::unexpected(leaf.error());
    if (auto header = check_header_fields(); !header) return tl::unexpected(header.error());
    return stack_need + needs_.stack;
  }

 private:
  Check check_leaf(const CustomLeaf& leaf, std::uint64_t at) {
    const LeafInfo& info = leaf.info;
    const InstanceRecord& record = view_.instances[info.primitive[0]];
    const std::uint64_t record_at = view_.instance_entry.offset + info.primitive[0] * sizeof(InstanceRecord);
    if (record.object >= objects_.size())
      return fail(FormatError::kBadInstance, record_at + offsetof(InstanceRecord, object), record.object,
                  objects_.size());
    const BufferView& object = objects_[record.object];
    if (!names_part(object, record.root))
      return fail(FormatError::kBadInstance, record_at + offsetof(InstanceRecord, root), record.root,
                  object.header->root);
    for (unsigned i = 0; i < 12; ++i) {
      const float x = i < 9 ? record.linear[i / 3][i % 3] : record.translation[i - 9];
      if (!std::isfinite(x)) return fail(FormatError::kBadInstance, record_at + 4 * i, float_bits(x), 0);
    }
    if (!LinearInverse(record).exists() || !(condition_of(record) <= double{kMaxCondition}))
      return fail(FormatError::kBadInstance, record_at, std::bit_cast<std::uint64_t>(LinearInverse(record).determinant),
                  0);
    needs_.add(record, records_[record.object]);
    // Whatever is made by another compiler's arithmetic has its slack.
    const Box content =
        InstanceBounder<Layout>(object, record, 0.0).bounds(InstanceBounder<Layout>::kToPrimitives, leaf.box[0]);
    if (const unsigned outside = first_plane_outside(content, leaf.box[0]); outside != kNoPlane)
      return fail(FormatError::kBoxNotContained, at + 4 * outside,
                  float_bits(side_of(content, outside / 3, outside % 3)),
                  float_bits(side_of(leaf.box[0], outside / 3, outside % 3)));
    return {};
  }

  /// A box node of the object, or a run's first leaf (or a later one: then a shorter run).
  static bool names_part(const BufferView& object, NodeRef ref) {
    if (ref == object.header->root && ref != kInvalidRef) return true;
    const SectionEntry& section = is_box(ref) ? object.nodes : object.leaves;
    const std::uint64_t offset = ref_offset(ref);
    if (ref == kInvalidRef || offset < section.offset || offset >= section.offset + section.count * section.stride ||
        (offset - section.offset) % section.stride != 0)
      return false;
    if (is_box(ref)) return ref_type(ref) == Layout::kBoxType;
    // Which kind a leaf is: its id bytes say.
    const auto& info = reinterpret_cast<const CustomLeaf*>(object.bytes.data() + offset)->info;
    return ref_type(ref) ==
           ((info.triangle_ids & TriangleId::kProcedural) != 0 ? NodeType::kProcedural : NodeType::kTriangle0);
  }

  Check check_header_fields() const {
    const FileHeader& header = *view_.header;
    if (header.features != needs_.features)
      return fail(FormatError::kFeatureMismatch, offsetof(FileHeader, features), header.features, needs_.features);
    if (header.levels != needs_.levels)
      return fail(FormatError::kBadLevels, offsetof(FileHeader, levels), header.levels, needs_.levels);
    // Other compilers' doubles differ in their last bits.
    constexpr double kAlmost = 1.0 - 0x1p-20;
    if (!(double{header.condition} >= kAlmost * needs_.condition))
      return fail(FormatError::kBadTransformBound, offsetof(FileHeader, condition), float_bits(header.condition),
                  float_bits(static_cast<float>(needs_.condition)));
    if (!(double{header.reach} >= kAlmost * needs_.reach))
      return fail(FormatError::kBadTransformBound, offsetof(FileHeader, reach), float_bits(header.reach),
                  float_bits(static_cast<float>(needs_.reach)));
    return {};
  }

  const BufferView& view_;
  std::span<const BufferView> objects_;
  std::span<const ObjectRecord> records_;
  InstanceNeeds needs_;
};

/// Object @p i's record says what its file does; nothing is between the files but zeros.
inline Check check_object_record(const BufferView& scene, std::size_t i, const BufferView& object) {
  ObjectRecord expected = describe(object);
  expected.offset = scene.objects[i].offset;
  const std::uint64_t at = scene.object_entry.offset + i * sizeof(ObjectRecord);
  using Words = std::array<std::uint32_t, sizeof(ObjectRecord) / 4>;
  const auto there = std::bit_cast<Words>(scene.objects[i]), wanted = std::bit_cast<Words>(expected);
  for (std::size_t word = 0; word < there.size(); ++word)
    if (there[word] != wanted[word]) return fail(FormatError::kBadObject, at + 4 * word, there[word], wanted[word]);
  std::uint64_t end = i == 0 ? scene.object_file_entry.offset : scene.objects[i - 1].offset + scene.objects[i - 1].size;
  for (; end < expected.offset; ++end)
    if (scene.bytes[end] != std::byte{0})
      return fail(FormatError::kBadReservedField, end, std::to_integer<std::uint64_t>(scene.bytes[end]), 0);
  return {};
}

}  // namespace hiprt::format_detail
