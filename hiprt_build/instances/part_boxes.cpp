#include <hiprt_build/format/view.h>
#include <hiprt_build/instances/part_boxes.h>

#include <algorithm>

namespace hiprt::build {

void PartBoxes::make(CpuEngine& engine) {
  const std::size_t count = group_->records.size();
  group_->parts.resize(count);
  group_->boxes.resize(count);
  engine.for_quiet_chunks(
      count,
      [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          group_->parts[i] = {static_cast<std::uint32_t>(i), objects_[group_->records[i].object].record.root};
          group_->boxes[i] = box_of(group_->parts[i]);
        }
      },
      kChunk);
}

void PartBoxes::make_moving(CpuEngine& engine, const Shutter& shutter) {
  group_->moving_boxes.resize(group_->parts.size());
  engine.for_quiet_chunks(
      group_->parts.size(),
      [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
          group_->moving_boxes[i] = moving_box_of(group_->parts[i], group_->boxes[i], shutter);
      },
      kChunk);
}

std::array<NodeRef, kBranching> PartBoxes::children_of(const InstancePart& part) const {
  const BufferView& object = object_of(part);
  return dispatch_layout(object.layout(), [&](auto layout) {
    using Node = typename decltype(layout)::Node;
    const auto& node = *reinterpret_cast<const Node*>(object.bytes.data() + ref_offset(part.ref));
    std::array<NodeRef, kBranching> children;
    std::copy_n(node.child, kBranching, children.begin());
    return children;
  });
}

Box PartBoxes::box_of(const InstancePart& part) const {
  if (part.ref == kInvalidRef) return format_detail::empty_box();
  const std::size_t i = part.instance;
  return box_in_scene(part, format_detail::InstanceMotionBounds(group_->records[i], group_->motion_of(i), kind_of(i)));
}

template <class Transform> Box PartBoxes::box_in_scene(const InstancePart& part, const Transform& to_scene) const {
  const BufferView& object = object_of(part);
  return dispatch_layout(object.layout(), [&](auto layout) {
    using Bounder = format_detail::InstanceBounder<decltype(layout), Transform>;
    return Bounder(object, to_scene)
        .bounds(part.ref,
                bounds_ == InstanceBounds::kPrimitives ? Bounder::kToPrimitives : static_cast<unsigned>(bounds_));
  });
}

/// @return the boxes at the begin and the end of the shutter. Each plane moves as far as between the boxes of the first
/// and the last key. @param whole the box over all times.
std::pair<Box, Box> PartBoxes::moving_box_of(const InstancePart& part, const Box& whole, const Shutter& shutter) const {
  using namespace format_detail;
  const std::size_t i = part.instance;
  const auto segments = group_->motion_of(i);
  if (segments.empty() || part.ref == kInvalidRef) return {whole, whole};
  const Box first = box_in_scene(part, InstanceKeyBounds(segments, kind_of(i), false)),
            last = box_in_scene(part, InstanceKeyBounds(segments, kind_of(i), true));
  const BoxDrift drift(first, last);
  const InstanceDriftBounds to_scene(group_->records[i], segments, kind_of(i), shutter, drift);
  return moving_box(box_in_scene(part, to_scene), drift, whole);
}

}  // namespace hiprt::build
