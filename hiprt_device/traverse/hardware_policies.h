#pragma once
/// Policies for the ray instruction of AMD's GPUs.

#include <hiprt_device/intersect/amd_ray_test.h>
#include <hiprt_device/traverse/policies.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Policies for the instruction. Layout may be FloatLayout or HalfLayout; Triangle Watertight, HardwareTriangle or
/// Fast.
///
///     struct Fastest : hiprt::HardwarePolicies { using Triangle = hiprt::HardwareTriangle; };
struct HardwarePolicies : Policies {
  using Layout = FloatLayout;
  using Boxes = HardwareBoxes;
  using Lanes = ArrayLanes;
  using ClosestOrder = AsTested;
  using AnyOrder = AsTested;
};

/// The policies of closest_hit(scene, ray) and any_hit(scene, ray) where kUsesRayInstruction and the file has widened
/// boxes. The lanes of a wave may trace different scenes.
template <RayInstructionLayout LayoutType> struct DefaultHardwarePolicies : HardwarePolicies {
  using Layout = LayoutType;
  using Boxes = BasicHardwareBoxes<false>;
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
