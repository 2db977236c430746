#pragma once
/// The kernel that makes instances that move. Internal.

#include <hiprt_build/instances/gpu_instance_kernels.h>

namespace hiprt::build::kernels {

/// Step: motion, record and box of instance i, if it has keys.
template <class Layout> struct MoveInstanceStep {
  MakeInstanceStep<Layout> still;
  gpu::DeviceMotions from;
  MotionRecord* motions;
  MotionSegment* segments;
  std::uint64_t segments_offset;  ///< From the first byte of the scene's file.

  HIPRT_HD InstanceStatus operator()(std::uint32_t i, format_detail::InstanceNeeds& needs) const {
    motions[i] = MotionRecord{};
    const gpu::KeyRange range = from.ranges[i];
    const DeviceInstance& instance = still.instances[i];
    if (range.count == 0 || instance.object >= still.objects.count) return InstanceStatus::kOk;
    const MadeMotion motion = make_motion(
        InstanceKeys{from, range}, [&](std::uint32_t segment, const MotionSegment& made) { segments[segment] = made; });
    if (motion.fault != MotionFault::kNone) return InstanceStatus::kBadMotion;
    MadeInstance made = make_instance(motion.first.to_scene.row);
    if (made.fault != TransformFault::kNone) return static_cast<InstanceStatus>(made.fault);
    still.set_numbers(made.record, instance);
    still.records[i] = made.record;
    const std::uint32_t count = range.count - 1;
    if (count != 0)
      motions[i] = {segments_offset + std::uint64_t{range.first} * sizeof(MotionSegment),
                    count,
                    from.kind,
                    affine_detail::round_up(motion.magnification.rounding),
                    affine_detail::round_up(motion.magnification.farthest),
                    {}};
    const ObjectRecord& object = still.objects.records[instance.object];
    if (object.root == kInvalidRef) return InstanceStatus::kOk;
    const Box box = count == 0 ? instance_box<Layout>(made.record, object, file_of(object), still.levels)
                               : swept_box(object, range.first, count);
    if (count == 0) {
      needs.add(made.record, object);
    } else {
      needs.add(made.record, object, motion.magnification);
      needs.features |= feature_bit(Feature::kMotion);
    }
    if (format_detail::first_bad_plane(box) != format_detail::kNoPlane) return InstanceStatus::kTooFar;
    still.boxes[i] = box;
    return InstanceStatus::kOk;
  }

 private:
  HIPRT_HD const std::byte* file_of(const ObjectRecord& object) const { return still.objects.base + object.offset; }

  HIPRT_HD Box swept_box(const ObjectRecord& object, std::uint32_t first, std::uint32_t count) const {
    const SweptBounds to_scene{segments + first, count, from.kind};
    using Bounder = format_detail::InstanceBounder<Layout, SweptBounds, format_detail::ShortPartStack<2>>;
    return Bounder(format_detail::BoundedObject(file_of(object), object), to_scene).bounds(object.root, still.levels);
  }
};

template <class Layout>
__global__ void __launch_bounds__(kInstanceBlock) move_instances(MoveInstanceStep<Layout> step, SharedNeeds* needs) {
  const std::uint32_t i = thread_index();
  if (i >= step.still.count) return;
  format_detail::InstanceNeeds mine;
  const InstanceStatus status = step(i, mine);
  if (mine.stack != 0) needs->add(mine);
  needs->add_fault(i, status);
}

}  // namespace hiprt::build::kernels
