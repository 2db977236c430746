/// bvhrender: renders a picture of a BVH file.

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/output_file.h>
#include <tools/build/build_progress.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/picture_key.h>
#include <tools/cli/progress.h>
#include <tools/cli/render_command.h>
#include <tools/cli/render_output.h>
#include <tools/cli/trace_device.h>
#include <tools/cli/unit_render.h>
#include <tools/render/studio/tree_boxes.h>

#include <hiprt_build/format/view.h>

#include <optional>

namespace {

using namespace hiprt;
using namespace hiprt::tools;

constexpr ToolInfo kInfo{
    "bvhrender",
    "Renders a picture of a BVH file as OpenEXR or PNG. The BVH file is validated first.\n"
    "\n"
    "Modes (--mode):\n"
    "  ao       clay below a soft sky\n"
    "  primary  clay lit from the eye\n"
    "  normals  0.5 + 0.5 * normal\n"
    "  heatmap  tests per ray and instances that the ray entered, with a histogram\n"
    "  bvh      the boxes --level levels below the root, and leaves above that level; the boxes of\n"
    "           instances are where the instances are in the middle of the shutter interval\n"
    "\n"
    "PNG: 8-bit sRGB. Colours above 1 are compressed (Reinhard, extended).\n"
    "EXR layers: R G B is the linear colour. All other layers belong to the ray through the pixel's centre:\n"
    "  N                               unit normal that faces the camera\n"
    "  P, Z                            position, and distance along the ray (inf: a miss)\n"
    "  id.geometry, id.primitive       numbers in the file or in the object that was hit (4294967295: a miss);\n"
    "                                  with --mode bvh id.primitive is the number of the box\n"
    "  id.instance                     index of the outermost instance, for scenes of instances\n"
    "  cost.boxes, cost.leaves         tests of four boxes, tests of leaves\n"
    "  cost.triangles, cost.fill       triangles in those leaves; used fraction of the leaves' capacity\n"
    "  cost.instances, cost.steps      instances that the ray entered; sum of box tests, leaf tests and instances\n"
    "\n"
    "The picture depends on the seed, but not on the device or the number of threads. The CPU counts tests: it traces\n"
    "all rays of heatmap, and for the cost layers of an EXR file the rays through the pixels' centres.",
    "  bvhrender bunny.bvh -o bunny.png                                       # a quick picture\n"
    "  bvhrender bunny.bvh -o bunny.exr -o bunny.png --size 1920x1080 --spp 256\n"
    "  bvhrender bunny.bvh -o cost.png --mode heatmap                         # where rays are expensive\n"
    "  bvhrender bunny.bvh -o boxes.png --mode bvh --level 4                  # the tree's boxes\n"
    "  bvhrender scene.bvh -o view.png --camera '0,1,5/0,1,0/0,1,0/40'        # another camera\n"
    "  bvhrender wheel.bvh -o blurred.png --shutter 0,0.02 --spp 256          # motion blur\n"
    "  bvhrender house.bvh -o house.exr --integrator path --materials house.glb --environment sky.exr --spp 1024\n"
    "  bvhrender bunny.bvh -o bunny.png --spp 16 --compare bunny.exr --difference flip.png\n"};

/// @return the GPU that traces, or nothing: the CPU traces.
build::Result<std::optional<GpuTracer>> choose_tracer(const RenderCommand& command, const BufferView& view) {
  const DeviceChoice choice = value_of(kDeviceChoices, command.device);
  if (command.render.mode != RenderMode::kHeatmap) return choose_device(choice, view);
  if (choice == DeviceChoice::kGpu)
    return invalid_input("--mode heatmap counts tests, which only the CPU does: use --device auto or cpu");
  return std::nullopt;
}

/// What is rendered: the scene, or the boxes of its tree as a scene of their own.
struct Subject {
  std::optional<TreeBoxes> boxes;
  build::Buffer buffer;  ///< BVH of the boxes.
  BufferView view;
};

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

/// What a picture is computed of, and by what.
struct Stage {
  const BufferView& view;
  const Camera& camera;
  GpuTracer* gpu;
  Checkpoint* checkpoint;  ///< nullptr without --resume.
};

build::Result<Rendering> render_with_bar(const Cli& cli, const RenderCommand& command, const Stage& stage) {
  ProgressBar bar;
  const auto progress = [&](double done) { bar.update("render", done); };
  // An error is ignored here: writing the final picture reports it.
  const auto keep = [&](const Rendering& so_far) {
    static_cast<void>(write_pictures(kInfo, command, stage.camera, so_far.image, /*stops=*/true));
  };
  if (stage.checkpoint != nullptr) {
    auto parts = PictureParts::make(command, stage.view, stage.camera, stage.gpu);
    if (!parts) return tl::unexpected(std::move(parts.error()));
    const auto warn = [&](const std::string& message) { cli.warn(message); };
    return render_units(command, **parts, stage.camera, {nullptr, stage.checkpoint, progress, warn, keep});
  }
  if (command.paths.chosen())
    return command.paths.render(stage.view, stage.camera, command.render, stage.gpu, bar, keep);
  return render(make_scene_view(stage.view), stage.camera, command.render, progress, stage.gpu);
}

/// Checks the checkpoint's path. It may exist, and then it is read later.
build::Result<void> check_resume(const RenderCommand& command) {
  if (command.resume.file.empty()) return {};
  std::vector<std::string> others = command.outputs;
  others.push_back(command.path);
  return check_output(command.resume.file, others);
}

/// Checks the outputs before long work begins.
build::Result<void> check_outputs(RenderCommand& command) {
  for (const std::string& output : command.outputs)
    if (auto checked = check_output(output, std::span(&command.path, 1)); !checked) return checked;
  if (auto checked = check_resume(command); !checked) return checked;
  const MemoryLimit reading(command.max_memory);
  return command.compare.prepare(command.render.width, command.render.height, command.path, command.outputs);
}

std::string resume_hint(const RenderCommand& command) {
  if (command.resume.file.empty()) return {};
  return "; run the same command again to go on from " + command.resume.file;
}

/// Writes, compares and prints the picture.
build::Result<void> finish(const Cli& cli, RenderCommand& command, const Camera& camera, const Rendering& rendering,
                           const std::optional<GpuTracer>& gpu) {
  const bool whole = rendering.samples == command.render.samples;
  const auto pictures = write_pictures(kInfo, command, camera, rendering.image, whole);
  if (!pictures) return tl::unexpected(pictures.error());
  if (!whole)
    return fail(build::ErrorCode::kCancelled,
                "cancelled: " + command.outputs[0] + " has " + std::to_string(rendering.samples) + " of " +
                    std::to_string(command.render.samples) + " samples" + resume_hint(command));
  if (auto compared = command.compare.run(rendering.image, command.render.threads); !compared) return compared;
  print(cli, {command, camera, rendering, device_word(gpu), device_name(gpu), *pictures});
  return {};
}

/// Reads what --integrator path needs.
build::Result<void> prepare_paths(const Cli& cli, RenderCommand& command, const BufferView& view,
                                  const Camera& camera) {
  if (!command.paths.chosen()) return {};
  const MemoryLimit reading(command.max_memory);
  return command.paths.prepare(view, camera, command.render, command.outputs,
                               [&](const std::string& warning) { cli.warn(warning); });
}

build::Result<void> run(const Cli& cli, RenderCommand& command) {
  const InterruptGuard guard;
  command.finish();
  if (auto checked = check_outputs(command); !checked) return checked;
  const auto file = load_bvh(command.path, command.render.threads);
  if (!file) return tl::unexpected(file.error());
  if (command.render.mode != RenderMode::kBoxes)
    if (auto checked = check_traceable(command.path, file->view); !checked) return checked;
  const auto camera = choose_camera(command, file->view.header->bounds);
  if (!camera) return tl::unexpected(camera.error());
  const auto subject = choose_subject(command, file->view);
  if (!subject) return tl::unexpected(subject.error());
  if (subject->boxes) command.render.boxes = &*subject->boxes;
  auto gpu = choose_tracer(command, subject->view);
  if (!gpu) return tl::unexpected(gpu.error());
  if (auto ready = prepare_paths(cli, command, subject->view, *camera); !ready) return ready;
  std::optional<Checkpoint> checkpoint;
  if (!command.resume.file.empty())
    checkpoint.emplace(command.resume.file, picture_key(tool_version(kInfo), file->view.bytes, command, *camera),
                       command.resume.seconds);
  const Stage stage{subject->view, *camera, *gpu ? &**gpu : nullptr, checkpoint ? &*checkpoint : nullptr};
  const auto rendering = render_with_bar(cli, command, stage);
  if (!rendering) return tl::unexpected(rendering.error());
  if (auto finished = finish(cli, command, *camera, *rendering, *gpu); !finished) return finished;
  if (checkpoint) checkpoint->remove();
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  RenderCommand command;
  Cli cli(kInfo);
  add_render_options(cli.app(), command);
  return cli.run(argc, argv, [&] { return run(cli, command); });
}
