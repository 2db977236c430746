#pragma once
/// Chooses the processor that a tool traces on.

#include <tools/base/device_choice.h>
#include <tools/base/names.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <hiprt_build/format/view.h>

#include <optional>
#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace hiprt::tools {

inline constexpr Names<DeviceChoice, 3> kDeviceChoices{
    {{"auto", DeviceChoice::kAuto}, {"cpu", DeviceChoice::kCpu}, {"gpu", DeviceChoice::kGpu}}};

/// Adds --device auto|cpu|gpu.
void add_device_option(CLI::App& app, std::string& device);

/// The GPUs that a rank may choose from.
struct GpuChoice {
  bool shared = false;          ///< Other ranks may use them, too: only `number` may be taken.
  std::optional<int> number{};  ///< Of this rank's GPU; nothing: there is none for it.
};

/// @param view of a file that validate() accepts. @param policies that rays will be traced with.
/// @return the GPU with a copy of the scene, or nothing if the CPU is to trace. kNoDevice, with the reason, only for
/// kGpu. Other errors of GpuTracer::make().
build::Result<std::optional<GpuTracer>> choose_device(DeviceChoice choice, const BufferView& view,
                                                      const TracePolicies& policies = {}, const GpuChoice& gpus = {});

/// "cpu" or "gpu".
std::string device_word(const std::optional<GpuTracer>& gpu);
/// The GPU's name, or the instruction set of the CPU's tracer.
std::string device_name(const std::optional<GpuTracer>& gpu);

}  // namespace hiprt::tools
