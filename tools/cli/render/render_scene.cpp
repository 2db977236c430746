#include <tools/cli/render/render_scene.h>

#include <tools/base/errors.h>
#include <tools/build/build_progress.h>
#include <tools/cli/progress.h>
#include <tools/cli/trace_device.h>

#include <hiprt_build/build.h>

#include <utility>

namespace hiprt::tools {

build::Result<Subject> choose_subject(const RenderCommand& command, const BufferView& scene) {
  Subject subject{{}, {}, scene};
  if (command.render.mode != RenderMode::kBoxes) return subject;
  const Shutter& shutter = command.render.shutter;
  auto boxes = boxes_of_level(scene, command.tree_level(), 0.5f * shutter.open + 0.5f * shutter.close);
  if (!boxes) return fail(boxes.error().code, command.path + ": " + boxes.error().message);
  subject.boxes = std::move(*boxes);
  ProgressBar bar;
  const build::TriangleMesh mesh{.positions = subject.boxes->corners, .triangles = subject.boxes->triangles};
  build::BuildOptions options{.builder = build::Builder::kHploc, .threads = command.render.threads};
  options.progress = build_progress([&](const char*, double fraction) { bar.update("boxes", fraction); });
  auto bvh = build::build({&mesh, 1}, options);
  if (!bvh) return tl::unexpected(std::move(bvh.error()));
  subject.buffer = std::move(bvh->buffer);
  const auto view = open_buffer(std::as_const(subject.buffer).bytes());
  if (!view) return invalid_input(to_string(view.error()));
  subject.view = *view;
  return subject;
}

build::Result<std::optional<GpuTracer>> choose_tracer(const RenderCommand& command, const BufferView& view,
                                                      const GpuChoice& gpus) {
  const DeviceChoice choice = value_of(kDeviceChoices, command.device);
  if (command.render.mode == RenderMode::kHeatmap) {
    if (choice != DeviceChoice::kGpu) return std::nullopt;
    return invalid_input("--mode heatmap counts tests, which only the CPU does: use --device auto or cpu");
  }
  return choose_device(choice, view, {}, gpus);
}

}  // namespace hiprt::tools
