#include <hiprt_device/traverse/hardware_policies.h>
#include <tests/gpu/traversal_kernels.h>

namespace hiprt::checks {

namespace {

template <class LayoutType, class TriangleType, class StackMemory, class SchedulePolicy = Immediate>
struct Hardware : HardwarePolicies {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Stack = typename StackMemory::Stack;
  using Schedule = SchedulePolicy;
};

/// trace() where there is the instruction.
template <class P, class StackMemory, Query kQuery, class Primitives>
__global__ void __launch_bounds__(kBlock) trace_by_hardware(Job job) {
  if constexpr (kHasRayInstruction) trace_rays<P, StackMemory, kQuery, NoFilter, Primitives>(job);
}

template <class P, class StackMemory, Query kQuery, class Primitives = NoPrimitives>
Variant hardware(const char* name) {
  const bool exact = std::is_same_v<typename P::Triangle, Watertight>;
  return {name,
          &trace_by_hardware<P, StackMemory, kQuery, Primitives>,
          P::Layout::kId,
          kQuery,
          Filtering::kNone,
          depth_of<P>(kQuery),
          P::Schedule::kBatchOnly,
          Primitives::kCount != 0,
          exact};
}

}  // namespace

std::span<const Variant> hardware_variants() {
  using Private = InPrivate<64>;
  using Rolling = RollingInGrid<8>;
  // So small that most rays use both parts.
  using Tiered = InTiers<2, 64>;
  static const Variant variants[] = {
      hardware<Hardware<FloatLayout, Watertight, Private>, Private, Query::kClosest>("float, closest"),
      hardware<Hardware<FloatLayout, Watertight, Private>, Private, Query::kAny>("float, any"),
      hardware<Hardware<HalfLayout, Watertight, Private, Postponed>, Private, Query::kAll>("half, postponed, all"),
      hardware<Hardware<FloatLayout, Watertight, Rolling, WholeWave<16>>, Rolling, Query::kClosest>(
          "float, rolling, whole wave, closest"),
      hardware<Hardware<FloatLayout, Watertight, Private>, Private, Query::kClosest, Customs>("float, closest, custom"),
      hardware<Hardware<HalfLayout, HardwareTriangle, Rolling>, Rolling, Query::kAny>(
          "half, rolling, any, triangles too"),
      hardware<Hardware<FloatLayout, HardwareTriangle, Private>, Private, Query::kClosest>(
          "float, closest, triangles too"),
      hardware<Hardware<HalfLayout, Watertight, Rolling>, Rolling, Query::kClosest>("half, rolling, closest"),
      hardware<Hardware<FloatLayout, Watertight, Tiered>, Tiered, Query::kClosest>("float, tiered, closest"),
  };
  return variants;
}

}  // namespace hiprt::checks
