#include <hiprt_build/format/view.h>
#include <hiprt_build/instances/instance_group.h>

#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances/instance_fault.h>
#include <hiprt_build/instances/motion_segments.h>

#include <algorithm>
#include <array>
#include <limits>
#include <queue>

namespace hiprt::build {
namespace {

std::string place(std::size_t group, std::size_t instance) {
  return "group " + std::to_string(group) + ", instance " + std::to_string(instance) + ": ";
}

/// @return the record of an instance, or an error that says what is wrong with its transform.
/// @param to_scene Instance::to_scene; of a moving instance, the transform of its first key.
Result<InstanceRecord> make_record(const Instance& instance, const Affine& to_scene, std::size_t group, std::size_t i) {
  MadeInstance made = make_instance(to_scene.row);
  if (made.fault != TransformFault::kNone)
    return tl::unexpected(invalid(place(group, i) + describe_fault(made.fault, made.determinant, made.condition)));
  made.record.object = instance.object;
  made.record.mask = instance.mask;
  made.record.id = instance.id;
  made.record.flags = instance.without_filter ? InstanceFlags::kNoFilter : 0;
  return made.record;
}

/// Adds instance @p i, which has a motion. @return kInvalidInput if the motion is invalid.
Result<InstanceRecord> add_motion(InstanceGroup& group, const Instance& instance, const ObjectRecord& object,
                                  std::size_t number, std::size_t i) {
  auto parts = make_motion(*instance.motion);
  if (!parts) return tl::unexpected(invalid(place(number, i) + parts.error().message));
  auto record = make_record(instance, parts->first.to_scene, number, i);
  if (!record || parts->segments.empty()) return record;
  group.motions.resize(group.records.size());
  group.motions[i] = {group.segments.size() * sizeof(MotionSegment),
                      static_cast<std::uint32_t>(parts->segments.size()),
                      instance.motion->kind,
                      affine_detail::round_up(parts->magnification.rounding),
                      affine_detail::round_up(parts->magnification.farthest),
                      {}};
  group.segments.insert(group.segments.end(), parts->segments.begin(), parts->segments.end());
  if (object.root == kInvalidRef) return record;
  group.needs.add(*record, object, parts->magnification);
  group.needs.features |= feature_bit(Feature::kMotion);
  return record;
}

/// The parts of instances that get a leaf each, and their boxes.
class PartBoxes {
 public:
  PartBoxes(InstanceGroup& group, std::span<const ObjectParts> objects, InstanceBounds bounds)
      : group_(group), objects_(objects), bounds_(bounds) {}

  /// One part per instance.
  void make(CpuEngine& engine) {
    const std::size_t count = group_.records.size();
    group_.parts.resize(count);
    group_.boxes.resize(count);
    engine.for_quiet_chunks(
        count,
        [&](std::size_t, std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            group_.parts[i] = {static_cast<std::uint32_t>(i), objects_[group_.records[i].object].record.root};
            group_.boxes[i] = box_of(group_.parts[i]);
          }
        },
        kChunk);
  }

  /// Computes the boxes at the begin and the end of the shutter.
  void make_moving(CpuEngine& engine, const Shutter& shutter) {
    group_.moving_boxes.resize(group_.parts.size());
    engine.for_quiet_chunks(
        group_.parts.size(),
        [&](std::size_t, std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i)
            group_.moving_boxes[i] = moving_box_of(group_.parts[i], group_.boxes[i], shutter);
        },
        kChunk);
  }

  /// Replaces the parts with the largest boxes by their children, until there are @p budget times as many parts as
  /// instances. A pass fills an eighth of the remaining capacity, so that all threads compute boxes. Which parts are
  /// opened depends little on this eighth, and not on the number of threads.
  void open(CpuEngine& engine, double budget) {
    const auto most = static_cast<std::size_t>(budget * static_cast<double>(group_.records.size()));
    std::priority_queue<std::pair<float, std::size_t>> largest;
    const auto offer = [&](std::size_t i) {
      const InstancePart& part = group_.parts[i];
      if (part.ref != kInvalidRef && is_box(part.ref) && part.depth < kMostOpenedLevels)
        largest.emplace(half_area(group_.boxes[i]), i);
    };
    for (std::size_t i = 0; i < group_.parts.size(); ++i) offer(i);
    std::vector<std::size_t> made;
    while (!largest.empty() && group_.parts.size() + kBranching - 1 <= most) {
      const std::size_t capacity = (most - group_.parts.size()) / (kBranching - 1);
      made.clear();
      for (std::size_t left = std::max<std::size_t>(capacity / 8, 1); left != 0 && !largest.empty(); --left) {
        add_children(largest.top().second, made);
        largest.pop();
      }
      group_.boxes.resize(group_.parts.size());
      engine.for_quiet_chunks(
          made.size(),
          [&](std::size_t, std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) group_.boxes[made[i]] = box_of(group_.parts[made[i]]);
          },
          kChunk);
      for (const std::size_t i : made) offer(i);
    }
  }

 private:
  /// Small, because a tight box (InstanceBounds) takes long to compute.
  static constexpr std::size_t kChunk = 64;

  static float half_area(const Box& box) {
    const float x = box.max[0] - box.min[0], y = box.max[1] - box.min[1], z = box.max[2] - box.min[2];
    return x * y + y * z + z * x;
  }

  const BufferView& object_of(const InstancePart& part) const {
    return objects_[group_.records[part.instance].object].view;
  }

  std::array<NodeRef, kBranching> children_of(const InstancePart& part) const {
    const BufferView& object = object_of(part);
    return dispatch_layout(object.layout(), [&](auto layout) {
      using Node = typename decltype(layout)::Node;
      const auto& node = *reinterpret_cast<const Node*>(object.bytes.data() + ref_offset(part.ref));
      std::array<NodeRef, kBranching> children;
      std::copy_n(node.child, kBranching, children.begin());
      return children;
    });
  }

  /// Replaces a part by its children. The first child gets the parent's index, the others are appended.
  /// @param made receives their indices.
  void add_children(std::size_t opened, std::vector<std::size_t>& made) {
    const InstancePart part = group_.parts[opened];
    bool first = true;
    for (const NodeRef child : children_of(part)) {
      if (child == kInvalidRef) continue;
      made.push_back(first ? opened : group_.parts.size());
      if (!first) group_.parts.emplace_back();
      first = false;
      group_.parts[made.back()] = {part.instance, child, part.depth + 1};
    }
  }

  MotionKind kind_of(std::size_t i) const { return group_.motions.empty() ? MotionKind{} : group_.motions[i].kind; }

  Box box_of(const InstancePart& part) const {
    if (part.ref == kInvalidRef) return format_detail::empty_box();
    const std::size_t i = part.instance;
    return box_of(part, format_detail::InstanceMotionBounds(group_.records[i], group_.motion_of(i), kind_of(i)));
  }
  template <class Transform> Box box_of(const InstancePart& part, const Transform& to_scene) const {
    const BufferView& object = object_of(part);
    return dispatch_layout(object.layout(), [&](auto layout) {
      using Bounder = format_detail::InstanceBounder<decltype(layout), Transform>;
      return Bounder(object, to_scene)
          .bounds(part.ref,
                  bounds_ == InstanceBounds::kPrimitives ? Bounder::kToPrimitives : static_cast<unsigned>(bounds_));
    });
  }

  /// @return the boxes at the begin and the end of the shutter. Each plane moves as far as between the boxes of the
  /// first and the last key. @param whole the box over all times.
  std::pair<Box, Box> moving_box_of(const InstancePart& part, const Box& whole, const Shutter& shutter) const {
    using namespace format_detail;
    const std::size_t i = part.instance;
    const auto segments = group_.motion_of(i);
    if (segments.empty() || part.ref == kInvalidRef) return {whole, whole};
    const Box first = box_of(part, InstanceKeyBounds(segments, kind_of(i), false)),
              last = box_of(part, InstanceKeyBounds(segments, kind_of(i), true));
    const BoxDrift drift(first, last);
    const InstanceDriftBounds to_scene(group_.records[i], segments, kind_of(i), shutter, drift);
    return moving_box(box_of(part, to_scene), drift, whole);
  }

  InstanceGroup& group_;
  std::span<const ObjectParts> objects_;
  InstanceBounds bounds_;
};

}  // namespace

std::optional<Shutter> shutter_of(std::span<const std::span<const Instance>> groups) {
  float first = std::numeric_limits<float>::infinity(), last = -first;
  const auto add = [&](const auto& keys) {
    // A motion with one key stands still.
    for (const auto& key : keys.size() > 1 ? std::span(keys) : std::span(keys).first(0)) {
      first = std::min(first, key.time);
      last = std::max(last, key.time);
    }
  };
  for (const auto& group : groups)
    for (const Instance& instance : group)
      if (instance.motion != nullptr) {
        add(instance.motion->keys);
        add(instance.motion->matrices);
      }
  const double length = double{last} - double{first};
  // The inverse of the length must be a normal number.
  if (!(length > 0x1p-100 && length < 0x1p100)) return std::nullopt;
  return Shutter{first, affine_detail::round_down(1.0 / length)};
}

Result<InstanceGroup> prepare_instances(CpuEngine& engine, std::span<const Instance> instances,
                                        std::span<const ObjectParts> objects, const InstanceOptions& options,
                                        const std::optional<Shutter>& shutter, std::size_t number) {
  InstanceGroup group;
  group.records.resize(instances.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    if (i % CpuEngine::kChunk == 0) engine.monitor().check();
    if (instances[i].object >= objects.size())
      return tl::unexpected(invalid(place(number, i) + "object " + std::to_string(instances[i].object) +
                                    ", those before the group are " + std::to_string(objects.size())));
    const ObjectRecord& object = objects[instances[i].object].record;
    auto record = instances[i].motion != nullptr ? add_motion(group, instances[i], object, number, i)
                                                 : make_record(instances[i], instances[i].to_scene, number, i);
    if (!record) return tl::unexpected(std::move(record.error()));
    group.records[i] = *record;
    if (object.root != kInvalidRef && group.motion_of(i).empty()) group.needs.add(*record, object);
  }
  if (!(group.needs.condition <= double{kMaxCondition}) ||
      !(group.needs.reach <= double{std::numeric_limits<float>::max()}))
    return tl::unexpected(
        invalid("group " + std::to_string(number) + ": " + describe_condition(group.needs.condition)));
  PartBoxes boxes(group, objects, options.bounds);
  boxes.make(engine);
  for (std::size_t i = 0; i < instances.size(); ++i)
    if (group.parts[i].ref != kInvalidRef && format_detail::first_bad_plane(group.boxes[i]) != format_detail::kNoPlane)
      return tl::unexpected(invalid(place(number, i) + "its bounds are beyond what floats hold"));
  boxes.open(engine, options.opening_budget);
  if (shutter) {
    boxes.make_moving(engine, *shutter);
    group.needs.features |= feature_bit(Feature::kMovingBoxes);
  }
  return group;
}

}  // namespace hiprt::build
