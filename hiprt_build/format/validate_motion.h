#pragma once
/// The part of validate() that checks the motion of one instance. Internal.

#include <hiprt_build/format/check.h>
#include <hiprt_build/format/motion_bounds.h>
#include <hiprt_build/format/view.h>

#include <cstddef>

namespace hiprt::format_detail {

/// Bounds in a file may be smaller than ours by this factor: doubles of other compilers differ in their last bits.
inline constexpr double kBoundSlack = 1.0 - 0x1p-20;

/// Checks the record and the segments of an instance that moves.
/// @param magnification receives how much the transforms magnify.
Check check_motion(const BufferView& view, std::size_t instance, MotionMagnification& magnification);

}  // namespace hiprt::format_detail
