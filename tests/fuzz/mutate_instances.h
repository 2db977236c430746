#pragma once
/// Changes of scenes with instances that keep most rules. Boxes, object records and headers are made again after them.

#include "refit.h"

#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_build/format/moving_box.h>
#include <hiprt_build/format/validate_motion.h>

#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

namespace hiprt::fuzz {

template <class Layout> class InstanceMutator {
 public:
  /// @param file with instances, accepted by validate().
  explicit InstanceMutator(test::TestFile& file) : file_(file), scene_(*open_buffer(file.bytes())) {
    for (const ObjectRecord& object : scene_.objects) objects_.push_back(*open_buffer(scene_.object_file(object)));
    for (std::size_t part = 0; part <= objects_.size(); ++part) own_stacks_.push_back(own_stack(view_of(part)));
  }

  /// Changes an instance, or the primitives of an object without instances.
  void change(Random& random) {
    const std::size_t part = random.below(objects_.size() + 1);
    test::TestFile bytes(view_of(part).bytes);
    const BufferView view = *open_buffer(bytes.bytes());
    if (!view.has_instances()) {
      Refit<Layout> refit(bytes, view);
      refit.move_primitives(random);
      refit.fit();
    } else if (!view.instances.empty()) {
      change_instance(bytes, view, part, random);
    }
    store(part, bytes);
  }

  /// From the first object to the scene, because an object may have instances of objects before it.
  void fit() {
    for (std::size_t part = 0; part <= objects_.size(); ++part) {
      test::TestFile bytes(view_of(part).bytes);
      const BufferView view = *open_buffer(bytes.bytes());
      if (view.has_instances()) fit_instances(bytes, view, own_stacks_[part]);
      bytes.seal();
      store(part, bytes);
      if (part == objects_.size()) break;
      ObjectRecord record = format_detail::describe(objects_[part]);
      record.offset = scene_.objects[part].offset;
      file_.put(scene_.object_entry.offset + part * sizeof(ObjectRecord), record);
    }
  }

 private:
  /// @param part number of an object; behind the last one: the scene.
  const BufferView& view_of(std::size_t part) const { return part < objects_.size() ? objects_[part] : scene_; }

  void store(std::size_t part, const test::TestFile& bytes) {
    const std::uint64_t at = part < objects_.size() ? scene_.objects[part].offset : 0;
    std::memcpy(file_.data() + at, bytes.data(), bytes.size());
  }

  /// The stack entries of a file's own tree.
  std::uint32_t own_stack(const BufferView& view) const {
    if (!view.has_instances()) return 0;
    format_detail::InstanceNeeds needs;
    for (const CustomLeaf& leaf : view.records<CustomLeaf>(view.leaves)) {
      const InstanceRecord& record = view.instances[leaf.info.primitive[0]];
      needs.add(record, scene_.objects[record.object]);
    }
    return view.header->stack_bound - needs.stack;
  }

  void change_instance(test::TestFile& bytes, const BufferView& view, std::size_t part, Random& random) const {
    const std::size_t i = random.below(view.instances.size());
    InstanceRecord record = view.instances[i];
    switch (random.below(view.motion_of(i).empty() ? 6 : 12)) {
      case 0:
        record.linear[random.below(3)][random.below(3)] = random.wild();
        break;
      case 1:
        record.translation[random.below(3)] = random.wild();
        break;
      case 2: {
        const int exponent = static_cast<int>(random.below(81)) - 40;
        for (auto& row : record.linear)
          for (float& x : row) x = std::ldexp(x, exponent);
        break;
      }
      case 3:
        record.mask = random.below(3) == 0 ? 0 : ~(std::uint32_t{1} << random.below(32));
        break;
      case 4:
        record.flags ^= InstanceFlags::kNoFilter;
        record.id = random.below(0xffffffffu);
        break;
      case 5:
        if (part != 0) replace_object(bytes, view, record, i, random.below(part));
        break;
      default:
        change_motion(bytes, view, i, random);
        break;
    }
    bytes.put(view.instance_entry.offset + i * sizeof(InstanceRecord), record);
  }

  /// Only instances with one leaf, which enters the object's root.
  void replace_object(test::TestFile& bytes, const BufferView& view, InstanceRecord& record, std::size_t i,
                      std::size_t object) const {
    const auto leaves = view.records<CustomLeaf>(view.leaves);
    std::size_t found = 0, last = 0;
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      if (leaves[k].info.primitive[0] != i) continue;
      ++found;
      last = k;
    }
    const NodeRef root = objects_[object].header->root;
    if (found != 1 || root == kInvalidRef) return;
    record.object = static_cast<std::uint32_t>(object);
    CustomLeaf leaf = leaves[last];
    leaf.info.primitive[1] = root;
    bytes.put(view.leaves.offset + last * sizeof(CustomLeaf), leaf);
  }

  /// Changes a number of a segment's places, matrices, scales or shears.
  static void change_motion(test::TestFile& bytes, const BufferView& view, std::size_t i, Random& random) {
    const MotionRecord& motion = view.motions[i];
    const std::uint64_t segment = motion.segments + random.below(motion.count) * sizeof(MotionSegment);
    const std::uint64_t translation = segment + offsetof(MotionSegment, translation),
                        stretch = segment + offsetof(MotionSegment, turning) + offsetof(TurningSegment, stretch),
                        linear = segment + offsetof(MotionSegment, linear);
    std::uint64_t at = translation + 4 * random.below(6);
    if (random.coin())
      at = motion.kind == MotionKind::kMatrix ? linear + 4 * random.below(18) : stretch + 4 * random.below(12);
    // Wild numbers would soon exceed the largest condition.
    bytes.put(at, random.below(4) == 0
                      ? random.wild()
                      : bytes.get<float>(at) * (0.25f + 0.125f * static_cast<float>(random.below(14))));
  }

  void fit_instances(test::TestFile& bytes, const BufferView& view, std::uint32_t own_stack) const {
    format_detail::InstanceNeeds needs;
    std::vector<Box> everywhere;
    const auto leaves = view.records<CustomLeaf>(view.leaves);
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      const std::size_t i = leaves[k].info.primitive[0];
      add_needs(bytes, view, i, needs);
      everywhere.push_back(box_in_scene(view, leaves[k].info, format_detail::InstanceMotionBounds(view, i)));
      CustomLeaf leaf = leaves[k];
      if (view.has_moving_boxes())
        std::tie(leaf.box[0], leaf.box[1]) = moving_boxes(view, leaf.info, everywhere.back());
      else
        leaf.box[0] = everywhere.back();
      bytes.put(view.leaves.offset + k * sizeof(CustomLeaf), leaf);
    }
    Refit<Layout>(bytes, view, everywhere).fit();
    bytes.put(offsetof(FileHeader, features),
              needs.features | (view.header->features & feature_bit(Feature::kMovingBoxes)));
    bytes.put(offsetof(FileHeader, levels), needs.levels);
    bytes.put(offsetof(FileHeader, condition), affine_detail::round_up(needs.condition));
    bytes.put(offsetof(FileHeader, reach), affine_detail::round_up(needs.reach));
    bytes.put(offsetof(FileHeader, stack_bound), own_stack + needs.stack);
  }

  /// Also makes the motion's own bounds.
  void add_needs(test::TestFile& bytes, const BufferView& view, std::size_t i,
                 format_detail::InstanceNeeds& needs) const {
    const InstanceRecord& record = view.instances[i];
    const ObjectRecord& object = scene_.objects[record.object];
    if (view.motion_of(i).empty()) {
      needs.add(record, object);
      return;
    }
    MotionMagnification magnification;
    // It fails for the record's old bounds, too.
    static_cast<void>(format_detail::check_motion(view, i, magnification));
    needs.add(record, object, magnification);
    needs.features |= feature_bit(Feature::kMotion);
    MotionRecord motion = view.motions[i];
    motion.rounding = affine_detail::round_up(magnification.rounding);
    motion.farthest = affine_detail::round_up(magnification.farthest);
    bytes.put(view.motion_entry.offset + i * sizeof(MotionRecord), motion);
  }

  template <class Transform>
  Box box_in_scene(const BufferView& view, const LeafInfo& info, const Transform& to_scene) const {
    using Bounder = format_detail::InstanceBounder<Layout, Transform>;
    const BufferView& object = objects_[view.instances[info.primitive[0]].object];
    return Bounder(object, to_scene).bounds(entered_ref(info), Bounder::kToPrimitives);
  }

  /// At the shutter's begin and end.
  std::pair<Box, Box> moving_boxes(const BufferView& view, const LeafInfo& info, const Box& everywhere) const {
    using namespace format_detail;
    const std::size_t i = info.primitive[0];
    const auto segments = view.motion_of(i);
    if (segments.empty()) return {everywhere, everywhere};
    const MotionKind kind = view.motions[i].kind;
    const BoxDrift drift(box_in_scene(view, info, InstanceKeyBounds(segments, kind, false)),
                         box_in_scene(view, info, InstanceKeyBounds(segments, kind, true)));
    const InstanceDriftBounds to_scene(view.instances[i], segments, kind,
                                       {view.header->shutter_begin, view.header->shutter_rate}, drift);
    return moving_box(box_in_scene(view, info, to_scene), drift, everywhere);
  }

  test::TestFile& file_;
  BufferView scene_;
  std::vector<BufferView> objects_;
  std::vector<std::uint32_t> own_stacks_;  ///< Of the objects and the scene.
};

}  // namespace hiprt::fuzz
