#include <tools/base/gpu_device.h>

#include <tools/base/gpu_code.h>

namespace hiprt::tools {

build::Result<gpu::Device> usable_device() {
  auto device = gpu::current_device();
  if (!device) return device;
  if (!runs_code_for_one_of(device->architecture, HIPRT_GPU_ARCHS))
    return gpu::fail(gpu::ErrorCode::kNoDevice, device->name, ": its architecture, ", device->architecture,
                     ", is not among those that this build has code for, " HIPRT_GPU_ARCHS);
  return device;
}

}  // namespace hiprt::tools
