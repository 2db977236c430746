#pragma once
/// The boxes of an instance group's parts, which get a leaf each. Internal.

#include <hiprt_build/instances/instance_group.h>

#include <array>

namespace hiprt::build {

class PartBoxes {
 public:
  /// @param objects those with lower numbers than the group. They and @p group must live as long as this.
  PartBoxes(InstanceGroup& group, std::span<const ObjectParts> objects, InstanceBounds bounds)
      : group_(&group), objects_(objects), bounds_(bounds) {}

  /// Makes one part per instance.
  void make(CpuEngine& engine);
  /// Computes the boxes at the begin and the end of the shutter.
  void make_moving(CpuEngine& engine, const Shutter& shutter);

  InstanceGroup& group() { return *group_; }
  /// The children of the node that a part leads to. @pre is_box(part.ref)
  std::array<NodeRef, kBranching> children_of(const InstancePart& part) const;
  /// A box that contains the part at all times.
  Box box_of(const InstancePart& part) const;

  /// Parts per chunk of parallel loops. Small, because a tight box (InstanceBounds) takes long to compute.
  static constexpr std::size_t kChunk = 64;

 private:
  const BufferView& object_of(const InstancePart& part) const {
    return objects_[group_->records[part.instance].object].view;
  }
  MotionKind kind_of(std::size_t i) const { return group_->motions.empty() ? MotionKind{} : group_->motions[i].kind; }
  template <class Transform> Box box_in_scene(const InstancePart& part, const Transform& to_scene) const;
  std::pair<Box, Box> moving_box_of(const InstancePart& part, const Box& whole, const Shutter& shutter) const;

  InstanceGroup* group_;
  std::span<const ObjectParts> objects_;
  InstanceBounds bounds_;
};

}  // namespace hiprt::build
