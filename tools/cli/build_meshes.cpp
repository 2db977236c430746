#include <tools/cli/build_meshes.h>

#include <tools/cli/gpu_builder.h>
#include <tools/cli/mesh_inputs.h>
#include <tools/cli/trace_device.h>

#include <utility>

namespace hiprt::tools {
namespace {

/// What only the CPU can do.
bool needs_cpu(const build::BuildOptions& wanted, bool imported) {
  return imported || wanted.builder > build::Builder::kHq;
}

/// The GPU's tree; nothing if the CPU is to build.
build::Result<std::optional<build::Bvh>> try_gpu(const build::SceneInput& scene, DeviceChoice choice,
                                                 const build::BuildOptions& wanted, bool imported) {
  const bool cpu_only = needs_cpu(wanted, imported) || !scene.customs.empty();
  if (choice == DeviceChoice::kCpu || (choice == DeviceChoice::kAuto && cpu_only)) return std::nullopt;
  if (cpu_only)
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput,
                                       scene.customs.empty()
                                           ? "a GPU builds neither Embree's trees nor imported ones"
                                           : "spheres and curves are built on the CPU: --device auto or cpu, please"});
  auto bvh = build_on_gpu(scene.meshes, wanted);
  if (bvh) return std::optional<build::Bvh>(std::move(*bvh));
  if (choice == DeviceChoice::kAuto && bvh.error().code == build::ErrorCode::kNoDevice) return std::nullopt;
  return tl::unexpected(build::Error{bvh.error().code, "GPU: " + bvh.error().message});
}

}  // namespace

bool may_use_gpu(const BuildCommand& command) { return value_of(kDeviceChoices, command.device) != DeviceChoice::kCpu; }

build::Result<Built> build_meshes(const build::SceneInput& scene, const BuildCommand& command,
                                  build::BuildOptions options, const std::optional<build::ExchangeBvh>& tree) {
  const DeviceChoice device = value_of(kDeviceChoices, command.device);
  const bool chosen = command.builder_given || !command.quality.empty();
  if (device == DeviceChoice::kGpu && !chosen) options.builder = build::Builder::kHploc;
  auto gpu = try_gpu(scene, device, options, tree.has_value());
  if (!gpu) return tl::unexpected(std::move(gpu.error()));
  if (*gpu) return Built{std::move(**gpu), options.builder, true};
  auto bvh = tree ? build::import_tree(scene, *tree, options) : build::build(scene, options);
  if (interrupted()) return tl::unexpected(cancelled());
  if (!bvh && tree) bvh.error().message.insert(0, command.imported + ": ");
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  return Built{std::move(*bvh), tree ? build::Builder::kImported : options.builder, false};
}

}  // namespace hiprt::tools
