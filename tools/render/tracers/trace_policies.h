#pragma once
/// The policies that the CPU's tracers are compiled for.

#include <tools/render/scene/trace_limits.h>

#include <hiprt_device/hiprt_device.h>

namespace hiprt::tools {
inline namespace HIPRT_ISA_NAMESPACE {

/// For scenes without instances.
template <class LayoutType, class TriangleType = Watertight, class BoxesType = Conservative,
          class CounterType = NoCounter>
struct FlatPolicies : Policies {
  using Layout = LayoutType;
  using Triangle = TriangleType;
  using Boxes = BoxesType;
  using Counter = CounterType;
  using Stack = PrivateStack<kTraceStack + kMostPushed>;
};

template <class Flat, unsigned kLevels, bool kMoves> struct ChooseLevels { using Type = Instanced<Flat, kLevels>; };
template <class Flat, unsigned kLevels> struct ChooseLevels<Flat, kLevels, true> {
  using Type = Moving<Instanced<Flat, kLevels>>;
};
template <class Flat> struct ChooseLevels<Flat, 0, false> { using Type = Flat; };

/// @p Flat for scenes of at most kLevels levels of instances, which move if kMoves.
template <class Flat, unsigned kLevels, bool kMoves>
using LevelPolicies = typename ChooseLevels<Flat, kLevels, kMoves>::Type;

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
