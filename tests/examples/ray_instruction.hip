// AMD's ray instruction for boxes, or for boxes and triangles, in kernels that run on every GPU.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

/// With the ray instruction where there is one; elsewhere with the same layout's tests in software.
template <class Hardware> HIPRT_HD hiprt::Hit closest_by(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  if constexpr (hiprt::kHasRayInstruction)
    return hiprt::closest_hit<Hardware>(scene, ray);
  else
    return hiprt::closest_hit<hiprt::WithLayout<typename Hardware::Layout>>(scene, ray);
}

/// Boxes by the instruction, triangles by the watertight test.
__global__ void trace_boxes_in_hardware(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits,
                                        unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = closest_by<hiprt::HardwarePolicies>(scene, rays[i]);
}

struct AllHardware : hiprt::HardwarePolicies {
  using Triangle = hiprt::HardwareTriangle;
};

/// Both by the instruction.
__global__ void trace_all_in_hardware(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits,
                                      unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = closest_by<AllHardware>(scene, rays[i]);
}
