#include <hiprt_build/format/view.h>
#include <hiprt_build/instances/instance_group.h>

#include <hiprt_build/input/check_input.h>
#include <hiprt_build/instances/instance_fault.h>
#include <hiprt_build/instances/motion_segments.h>

#include <algorithm>
#include <limits>

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
                                        std::span<const ObjectParts> objects, std::size_t number) {
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
  return group;
}

}  // namespace hiprt::build
