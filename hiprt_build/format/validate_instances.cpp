#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_build/format/leaf_walk.h>
#include <hiprt_build/format/moving_box.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/validate_instances.h>
#include <hiprt_build/format/validate_motion.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace hiprt::format_detail {

namespace {

/// Checks the instances of a file whose tree and leaves have been checked.
/// @tparam Layout of the file and of all objects.
template <class Layout> class InstanceCheck {
 public:
  /// @param objects that the instances may name, all of them valid.
  InstanceCheck(const BufferView& view, std::span<const BufferView> objects, std::span<const ObjectRecord> records)
      : view_(view), objects_(objects), records_(records) {}

  /// @param stack_need of the file's own tree.
  /// @return the stack entries of a traversal with all objects.
  tl::expected<std::uint32_t, FormatIssue> run(std::uint32_t stack_need, const ParallelLoop& loop) {
    if (view_.geometries.size() != 1 || view_.geometries[0].flags != custom_geometry_flags(0) ||
        view_.geometries[0].mask != 0xffffffffu)
      return fail(FormatError::kGeometryCount, view_.geometry_entry.offset, view_.geometries.size(), 1);
    if (view_.geometries[0].primitive_count != view_.instances.size())
      return fail(FormatError::kPrimitiveCount, view_.geometry_entry.offset + 8, view_.geometries[0].primitive_count,
                  view_.instances.size());
    const auto leaves = view_.records<CustomLeaf>(view_.leaves);
    if (auto checked = check_leaves(leaves, loop); !checked) return tl::unexpected(checked.error());
    if (view_.has_moving_boxes())
      if (auto runs = for_each_leaf<Layout>(view_, [this](const LeafVisit& run) { return check_run_box(run); }); !runs)
        return tl::unexpected(runs.error());
    if (auto parts = check_parts(leaves); !parts) return tl::unexpected(parts.error());
    if (auto header = check_header_fields(); !header) return tl::unexpected(header.error());
    return stack_need + needs_.stack;
  }

 private:
  /// Checks leaves in parts, because tight boxes take long.
  /// @return the fault of the first wrong leaf.
  Check check_leaves(std::span<const CustomLeaf> leaves, const ParallelLoop& loop) {
    struct Part {
      InstanceNeeds needs;
      std::optional<FormatIssue> issue;
    };
    constexpr std::size_t kLeaves = 1024;
    std::vector<Part> parts((leaves.size() + kLeaves - 1) / kLeaves);
    loop(parts.size(), [&](std::size_t p) {
      const std::size_t end = std::min(leaves.size(), (p + 1) * kLeaves);
      for (std::size_t i = p * kLeaves; i < end && !parts[p].issue; ++i)
        if (auto leaf = check_leaf(leaves[i], view_.leaves.offset + i * sizeof(CustomLeaf), parts[p].needs); !leaf)
          parts[p].issue = leaf.error();
    });
    for (const Part& part : parts) {
      if (part.issue) return tl::unexpected(*part.issue);
      needs_.add(part.needs);
    }
    return {};
  }

  Check check_leaf(const CustomLeaf& leaf, std::uint64_t at, InstanceNeeds& needs) const {
    const LeafInfo& info = leaf.info;
    const InstanceRecord& record = view_.instances[info.primitive[0]];
    const std::uint64_t record_at = view_.instance_entry.offset + info.primitive[0] * sizeof(InstanceRecord);
    if (record.object >= objects_.size())
      return fail(FormatError::kBadInstance, record_at + offsetof(InstanceRecord, object), record.object,
                  objects_.size());
    const BufferView& object = objects_[record.object];
    if ((record.flags & ~InstanceFlags::kKnown) != 0)
      return fail(FormatError::kBadReservedField, record_at + offsetof(InstanceRecord, flags), record.flags,
                  InstanceFlags::kKnown);
    if (!may_be_part(object, entered_ref(info)))
      return fail(FormatError::kBadInstance, at + offsetof(CustomLeaf, info) + 4, entered_ref(info),
                  object.header->root);
    for (unsigned i = 0; i < 12; ++i) {
      const float x = i < 9 ? record.linear[i / 3][i % 3] : record.translation[i - 9];
      if (!std::isfinite(x))
        return fail_float(FormatError::kBadInstance, record_at + 4 * i, x, std::numeric_limits<float>::max());
    }
    if (!LinearInverse(record).exists() || !(condition_of(record) <= double{kMaxCondition}))
      return fail_double(FormatError::kBadInstance, record_at, LinearInverse(record).determinant, 0.0);
    if (view_.motion_of(info.primitive[0]).empty())
      needs.add(record, records_[record.object]);
    else if (auto motion = add_motion(info.primitive[0], needs); !motion)
      return motion;
    if (object.has_instances() &&
        (object.has_moving_boxes() != view_.has_moving_boxes() ||
         float_bits(object.header->shutter_begin) != float_bits(view_.header->shutter_begin) ||
         float_bits(object.header->shutter_rate) != float_bits(view_.header->shutter_rate)))
      return fail_float(FormatError::kBadMotion, offsetof(FileHeader, shutter_begin), view_.header->shutter_begin,
                        object.header->shutter_begin);
    if (view_.has_moving_boxes()) return check_moving_box(object, leaf, at);
    // Boxes that another compiler's arithmetic has made have their own slack.
    const InstanceMotionBounds to_scene(view_, info.primitive[0], 0.0);
    const Box content = InstanceBounder<Layout>(object, to_scene)
                            .bounds(entered_ref(info), InstanceBounder<Layout>::kToPrimitives, leaf.box[0]);
    if (const unsigned outside = first_plane_outside(content, leaf.box[0]); outside != kNoPlane)
      return fail_plane(FormatError::kBoxNotContained, at + 4 * outside, outside, content, leaf.box[0]);
    return {};
  }

  /// Checks that the moving box contains the instance at all times, including the rounding of box_at().
  Check check_moving_box(const BufferView& object, const CustomLeaf& leaf, std::uint64_t at) const {
    for (unsigned k = 0; k < 2; ++k)
      if (const unsigned bad = first_bad_plane(leaf.box[k]); bad != kNoPlane)
        return fail_plane(FormatError::kBadBox, at + sizeof(Box) * k + 4 * bad, bad, leaf.box[k], leaf.box[k]);
    const std::size_t i = leaf.info.primitive[0];
    const auto segments = view_.motion_of(i);
    const BoxDrift drift(leaf.box[0], leaf.box[1]);
    const InstanceDriftBounds to_scene(view_.instances[i], segments,
                                       segments.empty() ? MotionKind{} : view_.motions[i].kind,
                                       {view_.header->shutter_begin, view_.header->shutter_rate}, drift, 0.0);
    // Planes that do not move are not rounded.
    Box inner = leaf.box[0];
    for (unsigned axis = 0; axis < 3; ++axis) {
      const double by = moving_box_slack(leaf.box[0], drift, axis);
      if (drift.min[axis] != 0.0) inner.min[axis] = affine_detail::round_up(double{inner.min[axis]} + by);
      if (drift.max[axis] != 0.0) inner.max[axis] = affine_detail::round_down(double{inner.max[axis]} - by);
    }
    const Box content = InstanceBounder<Layout, InstanceDriftBounds>(object, to_scene)
                            .bounds(entered_ref(leaf.info), InstanceBounder<Layout>::kToPrimitives, inner);
    if (const unsigned outside = first_plane_outside(content, inner); outside != kNoPlane)
      return fail_plane(FormatError::kBoxNotContained, at + 4 * outside, outside, content, inner);
    return {};
  }

  /// Checks that the run's box contains the instance at all times. With moving boxes the leaf's boxes do not.
  Check check_run_box(const LeafVisit& run) const {
    const CustomLeaf& leaf = view_.records<CustomLeaf>(view_.leaves)[run.index];
    const InstanceMotionBounds everywhere(view_, leaf.info.primitive[0], 0.0);
    const Box content = InstanceBounder<Layout>(objects_[view_.instances[leaf.info.primitive[0]].object], everywhere)
                            .bounds(entered_ref(leaf.info), InstanceBounder<Layout>::kToPrimitives, run.box);
    if (const unsigned outside = first_plane_outside(content, run.box); outside != kNoPlane)
      return fail_plane(FormatError::kBoxNotContained, view_.leaves.offset + run.index * sizeof(CustomLeaf), outside,
                        content, run.box);
    return {};
  }

  Check add_motion(std::size_t instance, InstanceNeeds& needs) const {
    MotionMagnification magnification;
    if (auto motion = check_motion(view_, instance, magnification); !motion) return motion;
    needs.add(view_.instances[instance], records_[view_.instances[instance].object], magnification);
    needs.features |= feature_bit(Feature::kMotion);
    return {};
  }

  /// Checks that the leaves of an instance cover its whole object without overlap.
  Check check_parts(std::span<const CustomLeaf> leaves) const {
    std::vector<std::uint32_t> order(leaves.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](std::uint32_t i) { return std::pair(leaves[i].info.primitive[0], i); };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
      const std::uint32_t instance = leaves[order[begin]].info.primitive[0];
      std::vector<NodeRef> parts;
      for (; end < order.size() && leaves[order[end]].info.primitive[0] == instance; ++end)
        parts.push_back(entered_ref(leaves[order[end]].info));
      std::sort(parts.begin(), parts.end());
      const BufferView& object = objects_[view_.instances[instance].object];
      if (!is_whole(object, parts))
        return fail(FormatError::kBadInstance,
                    view_.leaves.offset + order[begin] * sizeof(CustomLeaf) + offsetof(CustomLeaf, info) + 4, parts[0],
                    object.header->root);
    }
    return {};
  }

  /// @param parts sorted.
  static bool is_whole(const BufferView& object, std::span<const NodeRef> parts) {
    struct Step {
      NodeRef ref;
      unsigned depth;
    };
    std::size_t found = 0;
    std::vector<Step> pending{{object.header->root, 0}};
    while (!pending.empty()) {
      const auto [ref, depth] = pending.back();
      pending.pop_back();
      if (std::binary_search(parts.begin(), parts.end(), ref)) {
        ++found;
        continue;
      }
      if (!is_box(ref) || depth == kMostOpenedLevels) return false;
      const auto& node = *reinterpret_cast<const typename Layout::Node*>(object.bytes.data() + ref_offset(ref));
      for (const NodeRef child : node.child)
        if (child != kInvalidRef) pending.push_back({child, depth + 1});
    }
    return found == parts.size();
  }

  /// Whether the reference is a box node or a leaf of the object. check_parts() checks that a leaf is the first of its
  /// run.
  static bool may_be_part(const BufferView& object, NodeRef ref) {
    if (ref == kInvalidRef) return false;
    if (is_box(ref)) return object.has_node(ref) && ref_type(ref) == Layout::kBoxType;
    const SectionEntry& section = object.leaves;
    const std::uint64_t offset = ref_offset(ref);
    if (offset < section.offset || offset >= section.offset + section.count * section.stride ||
        (offset - section.offset) % section.stride != 0)
      return false;
    // The id bytes of a leaf say its kind.
    const auto& info = reinterpret_cast<const CustomLeaf*>(object.bytes.data() + offset)->info;
    return ref_type(ref) ==
           ((info.triangle_ids & TriangleId::kProcedural) != 0 ? NodeType::kProcedural : NodeType::kTriangle0);
  }

  Check check_header_fields() {
    const FileHeader& header = *view_.header;
    // Groups in a scene with moving boxes have the bit even if none of their instances moves.
    needs_.features |= header.features & feature_bit(Feature::kMovingBoxes);
    if (header.features != needs_.features)
      return fail(FormatError::kFeatureMismatch, offsetof(FileHeader, features), header.features, needs_.features);
    if (header.levels != needs_.levels)
      return fail(FormatError::kBadLevels, offsetof(FileHeader, levels), header.levels, needs_.levels);
    if (!(double{header.condition} >= kBoundSlack * needs_.condition))
      return fail_float(FormatError::kBadTransformBound, offsetof(FileHeader, condition), header.condition,
                        static_cast<float>(needs_.condition));
    if (!(double{header.reach} >= kBoundSlack * needs_.reach))
      return fail_float(FormatError::kBadTransformBound, offsetof(FileHeader, reach), header.reach,
                        static_cast<float>(needs_.reach));
    return {};
  }

  const BufferView& view_;
  std::span<const BufferView> objects_;
  std::span<const ObjectRecord> records_;
  InstanceNeeds needs_;
};

}  // namespace

Check check_instance_leaves(const BufferView& view) {
  if (!view.has_instances()) return {};
  const auto leaves = view.records<CustomLeaf>(view.leaves);
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    const LeafInfo& info = leaves[i].info;
    if ((info.geometry_and_flags & kLastInRun) == 0)
      return fail(FormatError::kInstanceLeaf,
                  view.leaves.offset + i * sizeof(CustomLeaf) + offsetof(CustomLeaf, info) +
                      offsetof(LeafInfo, geometry_and_flags),
                  info.geometry_and_flags, info.geometry_and_flags | kLastInRun);
  }
  return {};
}

tl::expected<std::uint32_t, FormatIssue> check_instances(const BufferView& view, std::span<const BufferView> objects,
                                                         std::span<const ObjectRecord> records,
                                                         std::uint32_t stack_need, const ParallelLoop& loop) {
  return dispatch_layout(view.layout(), [&](auto layout) {
    return InstanceCheck<decltype(layout)>(view, objects, records).run(stack_need, loop);
  });
}

Check check_object_record(const BufferView& scene, std::size_t i, const BufferView& object) {
  if (!scene.object_shapes.empty() && scene.object_shapes[i] != object.shape_entry.offset)
    return fail(FormatError::kBadShape, scene.object_shape_entry.offset + i * sizeof(std::uint64_t),
                scene.object_shapes[i], object.shape_entry.offset);
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
