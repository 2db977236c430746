/// bvhrender: renders a picture of a BVH file.

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/base/memory_limit.h>
#include <tools/base/output_file.h>
#include <tools/cli/bvh_file.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/cli/ranks/join_ranks.h>
#include <tools/cli/ranks/picture_key.h>
#include <tools/cli/ranks/rank_start.h>
#include <tools/cli/render/parts_engine.h>
#include <tools/cli/render/render_command.h>
#include <tools/cli/render/render_output.h>
#include <tools/cli/render/render_scene.h>
#include <tools/cli/render/unit_render.h>
#include <tools/cli/trace_device.h>

#include <hiprt_build/format/view.h>

#include <memory>
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
    "The picture depends on the seed, but not on the device or the number of threads and processes. The CPU counts\n"
    "tests: it traces all rays of heatmap, and for the cost layers of an EXR file the rays through the pixels' "
    "centres.",
    "  bvhrender bunny.bvh -o bunny.png                                       # a quick picture\n"
    "  bvhrender bunny.bvh -o bunny.exr -o bunny.png --size 1920x1080 --spp 256\n"
    "  bvhrender bunny.bvh -o cost.png --mode heatmap                         # where rays are expensive\n"
    "  bvhrender bunny.bvh -o boxes.png --mode bvh --level 4                  # the tree's boxes\n"
    "  bvhrender scene.bvh -o view.png --camera '0,1,5/0,1,0/0,1,0/40'        # another camera\n"
    "  bvhrender wheel.bvh -o blurred.png --shutter 0,0.02 --spp 256          # motion blur\n"
    "  bvhrender house.bvh -o house.exr --integrator path --materials house.glb --environment sky.exr --spp 1024\n"
    "  bvhrender bunny.bvh -o bunny.exr --spp 65536 --resume bunny.part       # goes on after a stop\n"
    "  mpirun -n 8 bvhrender city.json -o city.exr --integrator path          # parts of bvhbuild --parts 8\n"
    "  mpirun -n 4 bvhrender bunny.bvh -o bunny.exr --spp 65536               # on four processes\n"
    "  bvhrender bunny.bvh -o bunny.png --spp 16 --compare bunny.exr --difference flip.png\n"};

/// The scene, the camera, and what traces the scene.
struct Stage {
  std::optional<PartScene> parts;  ///< Instead of the file, the subject and the GPU.
  BvhFile file;
  Camera camera;
  Subject subject;
  std::optional<GpuTracer> gpu;

  GpuTracer* tracer() { return gpu ? &*gpu : nullptr; }
  /// Bytes that the picture depends on.
  std::span<const std::byte> bytes() const { return parts ? parts->bytes.bytes() : file.view.bytes; }
};

build::Result<std::unique_ptr<PictureEngine>> make_engine(const RenderCommand& command, Stage& stage, Ranks& ranks,
                                                          const GpuChoice& gpus) {
  const auto as_engine = [](auto made) -> build::Result<std::unique_ptr<PictureEngine>> {
    if (!made) return tl::unexpected(std::move(made.error()));
    return std::move(*made);
  };
  if (stage.parts) return as_engine(PartsEngine::make(command, *stage.parts, stage.camera, ranks, gpus));
  return as_engine(SceneEngine::make(command, stage.subject.view, stage.camera, stage.tracer()));
}

/// Fills subject and tracer. @pre file and camera are there.
build::Result<void> choose_subject_and_tracer(RenderCommand& command, const GpuChoice& gpus, Stage& stage) {
  auto subject = choose_subject(command, stage.file.view);
  if (!subject) return tl::unexpected(std::move(subject.error()));
  stage.subject = std::move(*subject);
  if (stage.subject.boxes) command.render.boxes = &*stage.subject.boxes;
  auto gpu = choose_tracer(command, stage.subject.view, gpus);
  if (!gpu) return tl::unexpected(std::move(gpu.error()));
  stage.gpu = std::move(*gpu);
  return {};
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

/// Reads what --integrator path needs.
build::Result<void> prepare_paths(const Cli& cli, RenderCommand& command, const BufferView& view,
                                  const Camera& camera) {
  if (!command.paths.chosen()) return {};
  const MemoryLimit reading(command.max_memory);
  return command.paths.prepare(view, camera, command.render, command.outputs,
                               [&](const std::string& warning) { cli.warn(warning); });
}

/// What a run says of a rank that is lost with its parts.
constexpr const char* kPartsAreGone = "its parts of the scene are gone: start the run again";

/// bvhrender on rank 0, which is the only one of a program that was started alone.
class FirstRank {
 public:
  FirstRank(const Cli& cli, RenderCommand& command, Ranks& ranks)
      : cli_(cli),
        command_(command),
        ranks_(ranks),
        is_parts_(is_part_manifest(command.path)),
        watch_(is_parts_ ? RankWatch(ranks, false, {}, kPartsAreGone)
                         : RankWatch(ranks, command.ranks.lossy, [&cli](const std::string& text) { cli.warn(text); })),
        start_(watch_) {}

  build::Result<void> run() {
    if (auto checked = check_outputs(command_); !checked) return checked;
    if (auto ready = prepare(); !ready) return ready;
    if (!command_.resume.file.empty()) checkpoint_.emplace(command_.resume.file, key(), command_.resume.seconds);
    const auto rendering = render_with_bar();
    ranks_.stop_others();
    if (!rendering) return tl::unexpected(rendering.error());
    if (auto finished = finish(*rendering); !finished) return finished;
    if (checkpoint_) checkpoint_->remove();
    return {};
  }

 private:
  bool alone() const { return ranks_.size() == 1; }
  PictureKey key() const { return picture_key(tool_version(kInfo), stage_.bytes(), command_, stage_.camera); }

  build::Result<void> prepare() {
    if (!alone()) {
      const auto share = start_.gather(own_means(ranks_, command_.device != "cpu"));
      if (!share) return tl::unexpected(share.error());
      gpus_ = take_share(*share, command_.render.threads);
    }
    return is_parts_ ? prepare_parts() : prepare_scene();
  }

  build::Result<void> prepare_parts() {
    auto scene = read_part_scene(command_);
    if (!scene) return tl::unexpected(std::move(scene.error()));
    stage_.parts = std::move(*scene);
    const auto camera = choose_camera(command_, stage_.parts->manifest.bounds());
    if (!camera) return tl::unexpected(camera.error());
    stage_.camera = *camera;
    if (!alone()) start_.begin(stage_.bytes(), stage_.camera, false);
    if (auto ready = command_.paths.prepare_sky(stage_.camera, command_.render, command_.outputs); !ready) return ready;
    if (!alone()) start_.send(command_.paths.data());
    return {};
  }

  build::Result<void> prepare_scene() {
    // The ranks of a host share the pages of a mapped file.
    auto file = alone() || command_.ranks.broadcast
                    ? load_bvh(command_.path, command_.max_memory, command_.render.threads)
                    : map_bvh(command_.path, command_.render.threads);
    if (!file) return tl::unexpected(std::move(file.error()));
    stage_.file = std::move(*file);
    if (command_.render.mode != RenderMode::kBoxes)
      if (auto checked = check_traceable(command_.path, stage_.file.view); !checked) return checked;
    const auto camera = choose_camera(command_, stage_.file.view.header->bounds);
    if (!camera) return tl::unexpected(camera.error());
    stage_.camera = *camera;
    if (!alone()) start_.begin(std::as_const(stage_.file.buffer).bytes(), stage_.camera, command_.ranks.broadcast);
    if (auto chosen = choose_subject_and_tracer(command_, gpus_, stage_); !chosen) return chosen;
    if (auto ready = prepare_paths(cli_, command_, stage_.subject.view, stage_.camera); !ready) return ready;
    if (!alone() && command_.paths.chosen()) start_.send(command_.paths.data());
    return {};
  }

  build::Result<Rendering> render_with_bar() {
    ProgressBar bar;
    const auto progress = [&](double done) { bar.update("render", done); };
    // An error is ignored here: writing the final picture reports it.
    const auto keep = [&](const Rendering& so_far) {
      static_cast<void>(write_pictures(kInfo, command_, stage_.camera, so_far.image, /*stops=*/true));
    };
    if (!alone() || checkpoint_ || is_parts_) return render_by_units(progress, keep);
    const BufferView& view = stage_.subject.view;
    if (command_.paths.chosen())
      return command_.paths.render(view, stage_.camera, command_.render, stage_.tracer(), bar, keep);
    return render(make_scene_view(view), stage_.camera, command_.render, progress, stage_.tracer());
  }

  build::Result<Rendering> render_by_units(const std::function<void(double)>& progress,
                                           const std::function<void(const Rendering&)>& keep) {
    auto engine = make_engine(command_, stage_, ranks_, gpus_);
    if (!engine) return tl::unexpected(std::move(engine.error()));
    gpu_of_parts_ = (*engine)->gpu_name();
    PictureWork& work = (*engine)->work();
    std::optional<RankCrew> crew;
    if (!alone()) {
      auto workers = start_.wait(key(), work.workers());
      if (!workers) return tl::unexpected(std::move(workers.error()));
      crew.emplace(watch_, std::move(*workers), work.pixel_bytes());
    }
    const auto warn = [&](const std::string& message) { cli_.warn(message); };
    return render_units(command_, **engine,
                        {crew ? &*crew : nullptr, checkpoint_ ? &*checkpoint_ : nullptr, progress, warn, keep});
  }

  /// Writes, compares and prints the picture.
  build::Result<void> finish(const Rendering& rendering) {
    const bool whole = rendering.samples == command_.render.samples;
    const auto pictures = write_pictures(kInfo, command_, stage_.camera, rendering.image, whole);
    if (!pictures) return tl::unexpected(pictures.error());
    if (!whole)
      return fail(build::ErrorCode::kCancelled,
                  "cancelled: " + command_.outputs[0] + " has " + std::to_string(rendering.samples) + " of " +
                      std::to_string(command_.render.samples) + " samples" + resume_hint(command_.resume));
    if (auto compared = command_.compare.run(rendering.image, command_.render.threads); !compared) return compared;
    const bool on_gpu = !gpu_of_parts_.empty();
    print(cli_, {command_, stage_.camera, rendering, on_gpu ? "gpu" : device_word(stage_.gpu),
                 on_gpu ? gpu_of_parts_ : device_name(stage_.gpu), ranks_.size(), *pictures});
    return {};
  }

  const Cli& cli_;
  RenderCommand& command_;
  Ranks& ranks_;
  bool is_parts_;
  GpuChoice gpus_;
  std::string gpu_of_parts_;
  RankWatch watch_;
  LeadStart start_;
  Stage stage_{};
  std::optional<Checkpoint> checkpoint_;
};

/// Reads the scene of another rank than 0.
build::Result<void> follow_scene(RenderCommand& command, FollowStart& start, const RankBegin& begin,
                                 const GpuChoice& gpus, Stage& stage) {
  if (is_part_manifest(command.path)) {
    auto bytes = start.bytes(begin, command.path);
    if (!bytes) return tl::unexpected(std::move(bytes.error()));
    auto scene = part_scene_of(command, std::move(*bytes));
    if (!scene) return tl::unexpected(std::move(scene.error()));
    stage.parts = std::move(*scene);
    return {};
  }
  auto file = start.scene(begin, command.path);
  if (!file) return tl::unexpected(std::move(file.error()));
  stage.file = std::move(*file);
  return choose_subject_and_tracer(command, gpus, stage);
}

/// bvhrender on another rank.
build::Result<void> follow(RenderCommand& command, Ranks& ranks) {
  FollowStart start(ranks);
  const auto begin = start.begin(own_means(ranks, command.device != "cpu"));
  if (!begin) return tl::unexpected(begin.error());
  const GpuChoice gpus = take_share(begin->share, command.render.threads);
  Stage stage{};
  stage.camera = begin->camera;
  if (auto ready = follow_scene(command, start, *begin, gpus, stage); !ready) return ready;
  if (command.paths.chosen()) {
    auto data = start.path_data();
    if (!data) return tl::unexpected(std::move(data.error()));
    command.paths.set_data(std::move(*data));
  }
  auto engine = make_engine(command, stage, ranks, gpus);
  if (!engine) return tl::unexpected(std::move(engine.error()));
  start.ready(picture_key(tool_version(kInfo), stage.bytes(), command, stage.camera), (*engine)->work().workers());
  return compute_for_first_rank(ranks, (*engine)->work());
}

build::Result<void> run(const Cli& cli, RenderCommand& command, Ranks& ranks) {
  const InterruptGuard guard;
  command.finish();
  if (!ranks.is_first()) return end_follower(ranks, follow(command, ranks));
  auto done = FirstRank(cli, command, ranks).run();
  ranks.stop_others();
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  RenderCommand command;
  Cli cli(kInfo);
  add_render_options(cli.app(), command);
  std::unique_ptr<Ranks> ranks;
  const int status = cli.run(argc, argv, [&]() -> build::Result<void> {
    if (auto joined = join_ranks(cli, command.ranks.lossy, ranks); !joined) return joined;
    return run(cli, command, *ranks);
  });
  return leave_run(ranks.get(), status);
}
