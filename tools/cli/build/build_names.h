#pragma once
/// Words for the choices of a build on command lines: one table per choice.

#include <tools/base/names.h>

#include <hiprt_build/build.h>
#include <hiprt_build/instances.h>

namespace hiprt::tools {

inline constexpr Names<build::Builder, 10> kBuilders{{{"sah", build::Builder::kSah},
                                                      {"lbvh", build::Builder::kLbvh},
                                                      {"lbvh30", build::Builder::kLbvh30},
                                                      {"ploc", build::Builder::kPloc},
                                                      {"hploc", build::Builder::kHploc},
                                                      {"sbvh", build::Builder::kSbvh},
                                                      {"hq", build::Builder::kHq},
                                                      {"embree-low", build::Builder::kEmbreeLow},
                                                      {"embree-medium", build::Builder::kEmbreeMedium},
                                                      {"embree-high", build::Builder::kEmbreeHigh}}};
inline constexpr Names<build::Quality, 3> kQualities{
    {{"fast", build::Quality::kFast}, {"balanced", build::Quality::kBalanced}, {"high", build::Quality::kHigh}}};
inline constexpr Names<NodeLayout, 4> kLayouts{{{"float", NodeLayout::kFloat},
                                                {"planes", NodeLayout::kPlanes},
                                                {"half", NodeLayout::kHalf},
                                                {"quantized", NodeLayout::kQuantized}}};
/// The layout that is traced fastest on each target.
inline constexpr Names<NodeLayout, 3> kTargetLayouts{
    {{"cpu", NodeLayout::kPlanes}, {"amd", NodeLayout::kFloat}, {"nvidia", NodeLayout::kPlanes}}};
inline constexpr Names<build::InstanceBounds, 4> kInstanceBounds{
    {{"root", build::InstanceBounds::kRoot},
     {"children", build::InstanceBounds::kChildren},
     {"grandchildren", build::InstanceBounds::kGrandchildren},
     {"primitives", build::InstanceBounds::kPrimitives}}};

}  // namespace hiprt::tools
