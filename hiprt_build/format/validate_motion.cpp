#include <hiprt_build/format/moving_box.h>
#include <hiprt_build/format/record_checks.h>
#include <hiprt_build/format/validate_motion.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>

namespace hiprt::format_detail {

namespace {

constexpr unsigned kSegmentWords = sizeof(MotionSegment) / 4;
using SegmentWords = std::array<std::uint32_t, kSegmentWords>;

/// Whether the instance is hidden at a key.
bool hides(const float (&stretch)[6]) {
  return std::all_of(std::begin(stretch), std::end(stretch), [](float x) { return x == 0.0f; });
}

/// Checks that rotations are unit quaternions and that stretches keep their sign, unless one hides the instance.
/// Neighbouring quaternions must be at a right angle (slerp), or at most at a right angle (nlerp).
/// @return the number of the first bad word, or kSegmentWords.
unsigned first_bad_turning_word(const TurningSegment& turning, MotionKind kind) {
  constexpr double kSlack = 0x1p-20;
  double dot = 0.0;
  for (unsigned k = 0; k < 2; ++k) {
    double squared = 0.0;
    for (unsigned i = 0; i < 4; ++i) squared += double{turning.rotation[k][i]} * double{turning.rotation[k][i]};
    if (!(std::fabs(squared - 1.0) <= kSlack)) return 8 + 4 * k;
  }
  for (unsigned i = 0; i < 4; ++i) dot += double{turning.rotation[0][i]} * double{turning.rotation[1][i]};
  if (kind == MotionKind::kSlerp ? std::fabs(dot) > kSlack : dot < -kSlack) return 12;
  const double most = kind == MotionKind::kSlerp ? 1.5707964 + kSlack : 0.0;
  if (!(turning.angle >= 0.0f && double{turning.angle} <= most)) return 16;
  if (hides(turning.stretch[0]) || hides(turning.stretch[1])) {
    // The other key, if it can be seen, has no 0 either.
    const unsigned other = hides(turning.stretch[0]) ? 1 : 0;
    for (unsigned k = 0; k < 3; ++k)
      if (turning.stretch[other][k] == 0.0f && !hides(turning.stretch[other])) return 17 + 6 * other + k;
    return kSegmentWords;
  }
  for (unsigned k = 0; k < 3; ++k)
    if (turning.stretch[0][k] == 0.0f || turning.stretch[1][k] == 0.0f ||
        std::signbit(turning.stretch[0][k]) != std::signbit(turning.stretch[1][k]))
      return 23 + k;
  return kSegmentWords;
}

/// @param before the previous segment, which ends where this one begins, or nullptr.
/// @return the number of the first word that is not allowed, or kSegmentWords.
unsigned first_bad_word(const MotionSegment& segment, MotionKind kind, const MotionSegment* before) {
  const auto words = std::bit_cast<SegmentWords>(segment);
  const bool turns = kind != MotionKind::kMatrix;
  const unsigned used = turns ? 29 : 26;
  for (unsigned i = 0; i < kSegmentWords; ++i) {
    if (i >= used && words[i] != 0) return i;
    if (!std::isfinite(std::bit_cast<float>(words[i]))) return i;
  }
  if (before != nullptr && before->time[1] != segment.time[0]) return 0;
  if (!(segment.time[0] < segment.time[1]) || !std::isfinite(segment.time[1] - segment.time[0])) return 1;
  return turns ? first_bad_turning_word(segment.turning, kind) : kSegmentWords;
}

/// Checks that, with moving boxes, the shutter of the header covers every key.
Check check_shutter(const FileHeader& header, const MotionSegment& segment) {
  const Shutter shutter{header.shutter_begin, header.shutter_rate};
  if (!(shutter.fraction(segment.time[0]) >= 0.0))
    return fail_float(FormatError::kBadMotion, offsetof(FileHeader, shutter_begin), header.shutter_begin,
                      segment.time[0]);
  if (!(shutter.fraction(segment.time[1]) <= 1.0 + 0x1p-40))
    return fail_float(FormatError::kBadMotion, offsetof(FileHeader, shutter_rate), header.shutter_rate,
                      segment.time[1]);
  return {};
}

Check check_segment(const BufferView& view, const MotionRecord& motion, std::span<const MotionSegment> segments,
                    std::size_t i, MotionMagnification& magnification) {
  const std::uint64_t at = motion.segments + i * sizeof(MotionSegment);
  const unsigned bad = first_bad_word(segments[i], motion.kind, i == 0 ? nullptr : &segments[i - 1]);
  if (bad < kSegmentWords)
    return fail_float(FormatError::kBadMotion, at + 4 * bad,
                      std::bit_cast<float>(std::bit_cast<SegmentWords>(segments[i])[bad]), 0.0f);
  if (view.has_moving_boxes())
    if (auto shutter = check_shutter(*view.header, segments[i]); !shutter) return shutter;
  motion_detail::BadMatrix singular{};
  if (!magnify(magnification, segments[i], motion.kind, singular))
    return fail_double(FormatError::kBadMotion,
                       at + (motion.kind == MotionKind::kMatrix
                                 ? offsetof(MotionSegment, linear)
                                 : offsetof(MotionSegment, turning) + offsetof(TurningSegment, stretch)),
                       singular.determinant, 0.0);
  return {};
}

}  // namespace

Check check_motion(const BufferView& view, std::size_t instance, MotionMagnification& magnification) {
  const MotionRecord& motion = view.motions[instance];
  const std::uint64_t at = view.motion_entry.offset + instance * sizeof(MotionRecord);
  if (motion.kind < MotionKind::kSlerp || motion.kind > MotionKind::kMatrix)
    return fail(FormatError::kBadMotion, at + offsetof(MotionRecord, kind), static_cast<std::uint32_t>(motion.kind),
                static_cast<std::uint32_t>(MotionKind::kMatrix));
  for (const std::uint32_t reserved : motion.reserved)
    if (reserved != 0) return fail(FormatError::kBadReservedField, at + offsetof(MotionRecord, reserved), reserved, 0);
  const auto segments = view.motion_of(instance);
  for (std::size_t i = 0; i < segments.size(); ++i)
    if (auto segment = check_segment(view, motion, segments, i, magnification); !segment) return segment;
  if (!(double{motion.rounding} >= kBoundSlack * magnification.rounding))
    return fail_float(FormatError::kBadMotion, at + offsetof(MotionRecord, rounding), motion.rounding,
                      static_cast<float>(magnification.rounding));
  if (!(double{motion.farthest} >= kBoundSlack * magnification.farthest))
    return fail_float(FormatError::kBadMotion, at + offsetof(MotionRecord, farthest), motion.farthest,
                      static_cast<float>(magnification.farthest));
  return {};
}

}  // namespace hiprt::format_detail
