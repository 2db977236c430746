#pragma once
/// The tracers: policies of hiprt over BVHs of hiprt, and Embree.

#include "kernel.h"

#include <hiprt_build/build.h>

#include <array>
#include <string_view>

namespace hiprt::bench {

struct Variant {
  std::string_view name;  ///< host_BUILDER or many_BUILDER, or LAYOUT_BUILDER[_fast|_array|_reference].
  NodeLayout layout;
  build::Builder builder;
  Tests tests = Tests::kAccurate;
  Lanes lanes = Lanes::kDefault;
};

/// The first one is what a program gets that chooses nothing.
inline constexpr std::array kVariants{
    Variant{"host_sbvh", NodeLayout::kPlanes, build::Builder::kSbvh, Tests::kAccurate, Lanes::kHost},
    Variant{"host_sah", NodeLayout::kPlanes, build::Builder::kSah, Tests::kAccurate, Lanes::kHost},
    Variant{"host_hq", NodeLayout::kPlanes, build::Builder::kHq, Tests::kAccurate, Lanes::kHost},
    Variant{"many_sbvh", NodeLayout::kPlanes, build::Builder::kSbvh, Tests::kAccurate, Lanes::kMany},
    Variant{"many_hq", NodeLayout::kPlanes, build::Builder::kHq, Tests::kAccurate, Lanes::kMany},
    Variant{"planes_sah", NodeLayout::kPlanes, build::Builder::kSah},
    Variant{"planes_sah_fast", NodeLayout::kPlanes, build::Builder::kSah, Tests::kFast},
    Variant{"planes_sah_array", NodeLayout::kPlanes, build::Builder::kSah, Tests::kAccurate, Lanes::kArray},
    Variant{"planes_hq", NodeLayout::kPlanes, build::Builder::kHq},
    Variant{"planes_hq_reference", NodeLayout::kPlanes, build::Builder::kHq, Tests::kReference},
    Variant{"planes_high", NodeLayout::kPlanes, build::Builder::kEmbreeHigh},
    Variant{"planes_high_fast", NodeLayout::kPlanes, build::Builder::kEmbreeHigh, Tests::kFast},
    Variant{"float_sah", NodeLayout::kFloat, build::Builder::kSah},
    Variant{"float_sah_fast", NodeLayout::kFloat, build::Builder::kSah, Tests::kFast},
    Variant{"float_high", NodeLayout::kFloat, build::Builder::kEmbreeHigh},
    Variant{"float_high_fast", NodeLayout::kFloat, build::Builder::kEmbreeHigh, Tests::kFast},
};

/// The reference: rtcIntersect1 / rtcOccluded1, RTC_SCENE_FLAG_ROBUST, medium quality.
inline constexpr std::string_view kEmbreeRobust = "embree_robust";
/// Embree without the flag.
inline constexpr std::string_view kEmbreeDefault = "embree_default";
/// The same by rtcIntersect8 / rtcOccluded8; primary and shadow rays with RTC_INTERSECT_CONTEXT_FLAG_COHERENT.
inline constexpr std::string_view kEmbreeEight = "embree_eight";

}  // namespace hiprt::bench
