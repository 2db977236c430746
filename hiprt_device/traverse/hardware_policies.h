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

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
