#pragma once
/// Moving boxes of instances. They move linearly from the begin of a scene's motion to its end, so a ray enters only
/// instances that are near it at its time.
///
/// In double, host only. hiprt_device/docs/decisions/0015-motion.md has the reasons.

#include <hiprt_build/format/motion_bounds.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace hiprt::format_detail {

/// The time interval in which a scene moves: FileHeader::shutter_begin and shutter_rate.
struct Shutter {
  float begin = 0.0f, rate = 0.0f;

  /// The fraction of the shutter at a time: 0 at the begin, 1 at the end.
  double fraction(double time) const { return (time - double{begin}) * double{rate}; }
};

/// How far each plane of a box has moved at the shutter's end.
struct BoxDrift {
  double min[3] = {}, max[3] = {};

  BoxDrift() = default;
  BoxDrift(const Box& begin, const Box& end) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      min[axis] = double{end.min[axis]} - double{begin.min[axis]};
      max[axis] = double{end.max[axis]} - double{begin.max[axis]};
    }
  }
};

/// Bounds of a moving instance relative to moving planes, for InstanceBounder.
///
/// bounds() holds at the begin of the shutter. At any later time it holds after its planes have moved by their part of
/// the drift.
class InstanceDriftBounds {
 public:
  /// @param slack as that of InstanceMotionBounds.
  InstanceDriftBounds(const InstanceRecord& record, std::span<const MotionSegment> segments, MotionKind kind,
                      const Shutter& shutter, const BoxDrift& drift, double slack = 1.0)
      : still_(record, slack), drift_(drift), slack_(slack) {
    for (const MotionSegment& segment : segments)
      parts_.push_back(
          {SegmentMotion(segment, kind), shutter.fraction(segment.time[0]), shutter.fraction(segment.time[1])});
  }

  Box bounds(const Box& box) const {
    Box result;
    if (parts_.empty()) {
      const Box still = still_.bounds(box);
      for (unsigned axis = 0; axis < 3; ++axis) {
        const double low = still.min[axis], high = still.max[axis];
        result.min[axis] = affine_detail::round_down(std::min(low, low - drift_.min[axis]));
        result.max[axis] = affine_detail::round_up(std::max(high, high - drift_.max[axis]));
      }
      return result;
    }
    MotionRange low[3], high[3];
    motion_detail::for_each_corner(box, [&](const double(&p)[3]) {
      for (unsigned axis = 0; axis < 3; ++axis) {
        grow(low[axis], axis, p, drift_.min[axis]);
        grow(high[axis], axis, p, drift_.max[axis]);
      }
    });
    return motion_detail::rounded_box(low, high);
  }

 private:
  struct Part {
    SegmentMotion motion;
    double begin, end;  ///< Fractions of the shutter.
  };

  void grow(MotionRange& range, unsigned axis, const double (&p)[3], double drift) const {
    for (const Part& part : parts_) {
      const MotionCurve curve = part.motion.curve(axis, p);
      MotionRange passed;
      curve.drifting(drift * part.begin, drift * part.end).grow(passed, slack_);
      // at_time() computes s with three roundings, so the instance may be where it is slightly earlier or later.
      // Bounds of planes that do not drift contain that already.
      const double beside = drift == 0.0 ? 0.0 : (4.0 + slack_) * 0x1p-24 * curve.speed();
      range.low = std::min(range.low, passed.low - beside);
      range.high = std::max(range.high, passed.high + beside);
    }
    // Before the first key and after the last the instance stands still.
    parts_.front().motion.curve(axis, p).grow_at(range, 0.0, 0.0, slack_);
    parts_.back().motion.curve(axis, p).grow_at(range, 1.0, drift, slack_);
  }

  StillInstanceBounds still_;
  std::vector<Part> parts_;
  BoxDrift drift_;
  double slack_;
};

/// Bounds of an instance when its motion begins, or when it ends.
class InstanceKeyBounds {
 public:
  InstanceKeyBounds(std::span<const MotionSegment> segments, MotionKind kind, bool last)
      : motion_(last ? segments.back() : segments.front(), kind), s_(last ? 1.0 : 0.0) {}

  Box bounds(const Box& box) const {
    MotionRange range[3];
    motion_detail::for_each_corner(box, [&](const double(&p)[3]) {
      for (unsigned axis = 0; axis < 3; ++axis) motion_.curve(axis, p).grow_at(range[axis], s_, 0.0, 1.0);
    });
    return motion_detail::rounded_box(range, range);
  }

 private:
  SegmentMotion motion_;
  double s_;
};

/// The largest rounding of box_at(): less than 12 u m.
///
/// m is the largest coordinate of both boxes along an axis, u = 2^-24. The error of the shutter's fraction is at most
/// 2 u. The added term is at most 2 m, so its error from that is 4 u m. The difference adds 2 u m, the product 2 u m,
/// and the sum u m.
inline double moving_box_slack(const Box& begin, const BoxDrift& drift, unsigned axis) {
  const double low = begin.min[axis], high = begin.max[axis];
  return 12 * 0x1p-24 *
         std::max(
             {std::fabs(low), std::fabs(high), std::fabs(low + drift.min[axis]), std::fabs(high + drift.max[axis])});
}

/// The boxes of an instance at the shutter's begin and end, including the rounding of box_at().
/// @param at_begin the result of InstanceDriftBounds.
/// @return @p whole, twice, if floats cannot express these boxes.
inline std::pair<Box, Box> moving_box(const Box& at_begin, const BoxDrift& drift, const Box& whole) {
  Box begin, end;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double low = at_begin.min[axis], high = at_begin.max[axis];
    const double low_end = low + drift.min[axis], high_end = high + drift.max[axis];
    const double slack = 1.25 * moving_box_slack(at_begin, drift, axis);
    begin.min[axis] = affine_detail::round_down(low - slack);
    end.min[axis] = affine_detail::round_down(low_end - slack);
    begin.max[axis] = affine_detail::round_up(high + slack);
    end.max[axis] = affine_detail::round_up(high_end + slack);
    for (const float gone : {end.min[axis] - begin.min[axis], end.max[axis] - begin.max[axis]})
      if (!std::isfinite(gone)) return {whole, whole};
  }
  return {begin, end};
}

}  // namespace hiprt::format_detail
