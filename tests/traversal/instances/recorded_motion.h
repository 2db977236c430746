#pragma once
/// Motions as files record them.

#include <tests/traversal/instances/moving_scenes.h>

#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_build/format/moving_box.h>
#include <hiprt_build/instances/motion_segments.h>
#include <hiprt_device/instances/motion.h>

#include <algorithm>
#include <array>

namespace hiprt::checks {

inline constexpr MotionKind kKinds[] = {MotionKind::kSlerp, MotionKind::kNlerp, MotionKind::kMatrix};
inline constexpr const char* kKindNames[] = {"", "slerp", "nlerp", "matrix"};

inline const char* name_of(MotionKind kind) { return kKindNames[static_cast<unsigned>(kind)]; }

/// A motion in memory as it is in a file.
struct Recorded {
  build::MotionParts parts;
  MotionRecord record{};
  InstanceRecord instance{};

  explicit Recorded(const build::Motion& motion) {
    auto made = build::make_motion(motion);
    INFO((made ? std::string() : made.error().message));
    REQUIRE(made.has_value());
    parts = std::move(*made);
    record = {0,
              static_cast<std::uint32_t>(parts.segments.size()),
              motion.kind,
              affine_detail::round_up(parts.magnification.rounding),
              affine_detail::round_up(parts.magnification.farthest),
              {}};
  }
  InstanceRecord at(float time) const {
    return at_time(instance, record, reinterpret_cast<const std::byte*>(parts.segments.data()), time);
  }
  Box bounds(const Box& box) const {
    return format_detail::InstanceMotionBounds(instance, parts.segments, record.kind).bounds(box);
  }
  /// At the begin and the end of a shutter.
  std::array<Box, 2> moving_box(const Box& box, const format_detail::Shutter& shutter) const {
    using namespace format_detail;
    const BoxDrift drift(InstanceKeyBounds(parts.segments, record.kind, false).bounds(box),
                         InstanceKeyBounds(parts.segments, record.kind, true).bounds(box));
    const InstanceDriftBounds to_scene(instance, parts.segments, record.kind, shutter, drift);
    const auto [begin, end] = format_detail::moving_box(to_scene.bounds(box), drift, bounds(box));
    return {begin, end};
  }
  /// A coordinate of a point at a time: the result of at_time() if it rounded only s.
  double coordinate(unsigned axis, const double (&p)[3], float time) const {
    const auto& segments = parts.segments;
    std::size_t i = 0;
    while (i + 1 < segments.size() && time > segments[i].time[1]) ++i;
    const double s = part_of(segments[i].time[0], segments[i].time[1], time);
    return SegmentMotion(segments[i], record.kind).curve(axis, p).at(s).value;
  }
};

/// Times between, at, before and behind the keys.
inline float random_time(oracle::Random& random, const build::Motion& motion) {
  const auto& keys = motion.keys;
  const auto chosen = random.below(static_cast<std::uint32_t>(keys.size()));
  if (random.below(8) == 0) return keys[chosen].time;
  return random.uniform_float(static_cast<double>(keys.front().time) - 0.5,
                              static_cast<double>(keys.back().time) + 0.5);
}

}  // namespace hiprt::checks
