#pragma once
/// The policy sets that are compared. The compiler's settings are the other part of a subject's name (work.h).

#include <hiprt_device/format/layout.h>

#include <cstddef>
#include <string_view>

namespace hiprt::bench {

/// HIPRT_POLICY_SET(number, name, triangle test, box test, layout). The first kFastMathSets are also compiled with
/// fast-math. WatertightDouble: DoubleRays with the float rays of the other sets; hits are rounded to floats.
#define HIPRT_POLICY_SETS(HIPRT_POLICY_SET)                                           \
  HIPRT_POLICY_SET(0, "fast", Fast, Plain, PlanesLayout)                              \
  HIPRT_POLICY_SET(1, "fast+conservative", Fast, Conservative, PlanesLayout)          \
  HIPRT_POLICY_SET(2, "watertight+plain", Watertight, Plain, PlanesLayout)            \
  HIPRT_POLICY_SET(3, "default", Watertight, Conservative, PlanesLayout)              \
  HIPRT_POLICY_SET(4, "reference", Reference, Conservative, PlanesLayout)             \
  HIPRT_POLICY_SET(5, "default/float", Watertight, Conservative, FloatLayout)         \
  HIPRT_POLICY_SET(6, "default/half", Watertight, Conservative, HalfLayout)           \
  HIPRT_POLICY_SET(7, "default/quantized", Watertight, Conservative, QuantizedLayout) \
  HIPRT_POLICY_SET(8, "double", WatertightDouble, Conservative, PlanesLayout)

struct PolicySet {
  std::string_view name;
  std::string_view triangle, boxes;
  NodeLayout layout;
};

inline constexpr PolicySet kPolicySets[] = {
#define HIPRT_POLICY_SET(number, name, triangle, boxes, layout) {name, #triangle, #boxes, layout::kId},
    HIPRT_POLICY_SETS(HIPRT_POLICY_SET)
#undef HIPRT_POLICY_SET
};
inline constexpr std::size_t kFastMathSets = 5;

}  // namespace hiprt::bench
