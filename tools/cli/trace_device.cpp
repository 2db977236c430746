#include <tools/cli/trace_device.h>

#include <tools/base/errors.h>
#include <tools/cli/cli.h>

#include <hiprt_build/format/view.h>

#include <CLI/CLI.hpp>

namespace hiprt::tools {

void add_device_option(CLI::App& app, std::string& device) {
  app.add_option("--device", device,
                 "auto: the GPU if there is one that this build has code for, else the CPU. Both give the same results "
                 "(with --triangle-test fast the last bits may differ)")
      ->check(CLI::IsMember(words(kDeviceChoices)))
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kMachineGroup);
}

build::Result<std::optional<GpuTracer>> choose_device(DeviceChoice choice, const BufferView& view,
                                                      const TracePolicies& policies, const GpuChoice& gpus) {
  if (choice == DeviceChoice::kCpu) return std::nullopt;
  if (gpus.shared && !gpus.number && !GpuTracer::devices().empty()) {
    if (choice == DeviceChoice::kAuto) return std::nullopt;
    return fail(build::ErrorCode::kNoDevice,
                "--device gpu, but the host has fewer GPUs than ranks: start fewer, or use --device auto");
  }
  auto gpu = GpuTracer::make(view, {.device = gpus.number, .policies = policies});
  if (gpu) return std::optional<GpuTracer>(std::move(*gpu));
  if (choice == DeviceChoice::kAuto && gpu.error().code == build::ErrorCode::kNoDevice) return std::nullopt;
  return fail(gpu.error().code, "GPU: " + gpu.error().message);
}

std::string device_word(const std::optional<GpuTracer>& gpu) { return gpu ? "gpu" : "cpu"; }

std::string device_name(const std::optional<GpuTracer>& gpu) { return gpu ? gpu->device_name() : trace_isa(); }

}  // namespace hiprt::tools
