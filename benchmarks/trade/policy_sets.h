#pragma once
/// The policy sets that are compared, by name. The compiler's settings are another part of a name: see kernels.h.

#include <hiprt_device/format/node.h>

#include <array>
#include <string_view>

namespace hiprt::bench {

struct PolicySet {
  std::string_view name;
  std::string_view triangle, boxes;
  NodeLayout layout;
};

/// HIPRT_POLICY_SET(number, triangle test, box test, layout); in the order of kPolicySets.
#define HIPRT_POLICY_SETS(HIPRT_POLICY_SET)                   \
  HIPRT_POLICY_SET(0, Fast, Plain, PlanesLayout)              \
  HIPRT_POLICY_SET(1, Fast, Conservative, PlanesLayout)       \
  HIPRT_POLICY_SET(2, Watertight, Plain, PlanesLayout)        \
  HIPRT_POLICY_SET(3, Watertight, Conservative, PlanesLayout) \
  HIPRT_POLICY_SET(4, Reference, Conservative, PlanesLayout)  \
  HIPRT_POLICY_SET(5, Watertight, Conservative, FloatLayout)  \
  HIPRT_POLICY_SET(6, Watertight, Conservative, HalfLayout)   \
  HIPRT_POLICY_SET(7, Watertight, Conservative, QuantizedLayout)

inline constexpr std::array<PolicySet, 8> kPolicySets{{
    {"fast", "Fast", "Plain", NodeLayout::kPlanes},
    {"fast+conservative", "Fast", "Conservative", NodeLayout::kPlanes},
    {"watertight+plain", "Watertight", "Plain", NodeLayout::kPlanes},
    {"default", "Watertight", "Conservative", NodeLayout::kPlanes},
    {"reference", "Reference", "Conservative", NodeLayout::kPlanes},
    {"default/float", "Watertight", "Conservative", NodeLayout::kFloat},
    {"default/half", "Watertight", "Conservative", NodeLayout::kHalf},
    {"default/quantized", "Watertight", "Conservative", NodeLayout::kQuantized},
}};

}  // namespace hiprt::bench
