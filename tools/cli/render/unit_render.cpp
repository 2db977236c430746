#include <tools/cli/render/unit_render.h>

#include <tools/base/errors.h>
#include <tools/render/units/path_work.h>
#include <tools/render/units/studio_work.h>

#include <chrono>
#include <future>
#include <utility>

namespace hiprt::tools {
namespace {

/// Whether --integrator path was given: then the work is a PathWork, else a StudioWork.
bool is_path(const RenderCommand& command) { return command.paths.chosen(); }

unsigned workers_of_all(PictureWork& work, const Crew* crew) {
  unsigned workers = work.workers();
  for (unsigned rank = 1; crew != nullptr && rank < crew->ranks(); ++rank) workers += crew->workers(rank);
  return workers;
}

build::Result<PictureState> first_state(const RenderCommand& command, PictureWork& work, const UnitRun& run) {
  const RenderOptions& options = command.render;
  const PictureGrid grid = choose_grid(options.width, options.height, workers_of_all(work, run.crew));
  if (run.checkpoint == nullptr) return PictureState(grid, work.pixel_bytes());
  auto kept = run.checkpoint->load(grid, work.steps(), work.pixel_bytes());
  if (!kept) return tl::unexpected(std::move(kept.error()));
  return *kept ? std::move(**kept) : PictureState(grid, work.pixel_bytes());
}

/// The message of a run that was interrupted before its picture could be written.
build::Error cancelled_error(const UnitRun& run) {
  if (run.checkpoint == nullptr) return {build::ErrorCode::kCancelled, "cancelled, nothing was written"};
  return {build::ErrorCode::kCancelled,
          "cancelled: " + run.checkpoint->path() + " keeps what was computed; run the same command again to go on"};
}

void count(const PictureState& state, Rendering& rendering) {
  rendering.rays = state.rays;
  rendering.seconds = state.seconds;
}

/// A path-traced picture. This process computes its layers beside the units.
class LayeredPaths {
 public:
  LayeredPaths(const RenderCommand& command, PictureEngine& engine)
      : engine_(engine),
        samples_(command.render.samples),
        threads_(engine.work().workers()),
        coming_(std::async(std::launch::async, [&engine] { return engine.layers(); })) {}
  LayeredPaths(const LayeredPaths&) = delete;
  LayeredPaths& operator=(const LayeredPaths&) = delete;
  /// Waits for the layers.
  ~LayeredPaths() {
    if (coming_.valid()) engine_.stop_layers();
  }

  /// Whether picture() does not wait.
  bool ready() const {
    return !coming_.valid() || coming_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }

  /// @return the picture after the samples so far, or the error of PathCommand::layers().
  build::Result<const Rendering*> picture(const PictureState& state) {
    if (coming_.valid()) {
      auto image = coming_.get();
      if (!image) return tl::unexpected(std::move(image.error()));
      rendering_.emplace(Rendering{std::move(*image), {}, 0, 0.0, 0, 0.0});
    }
    PathCommand::take(picture_of(state.pixels, samples_, threads_), false, *rendering_);
    count(state, *rendering_);
    return &*rendering_;
  }

 private:
  PictureEngine& engine_;
  std::uint32_t samples_;
  unsigned threads_;
  std::future<build::Result<Image>> coming_;
  std::optional<Rendering> rendering_;
};

build::Result<Rendering> render_paths(const RenderCommand& command, PictureEngine& engine, const UnitRun& run,
                                      PictureState& state, PictureHooks hooks) {
  LayeredPaths paths(command, engine);
  double next = 1.0;
  const auto keep = [&] {
    if (state.seconds < next || !paths.ready()) return;
    next = 2.0 * state.seconds;
    if (const auto picture = paths.picture(state); picture && (*picture)->samples != 0) run.keep(**picture);
  };
  if (run.keep) hooks.step = keep;
  const auto whole = compute(engine.work(), state, run.crew, run.checkpoint, hooks);
  if (!whole) return tl::unexpected(whole.error());
  const auto picture = paths.picture(state);
  if (!picture) return tl::unexpected(picture.error());
  if ((*picture)->samples == 0) return tl::unexpected(cancelled_error(run));
  return **picture;
}

build::Result<Rendering> render_studio(PictureEngine& engine, const UnitRun& run, PictureState& state,
                                       const PictureHooks& hooks) {
  const auto whole = compute(engine.work(), state, run.crew, run.checkpoint, hooks);
  if (!whole) return tl::unexpected(whole.error());
  if (!*whole) return tl::unexpected(cancelled_error(run));
  Rendering rendering = static_cast<const StudioWork&>(engine.work()).picture(state.pixels);
  count(state, rendering);
  return rendering;
}

}  // namespace

build::Result<std::unique_ptr<SceneEngine>> SceneEngine::make(const RenderCommand& command, const BufferView& view,
                                                              const Camera& camera, GpuTracer* gpu) {
  std::unique_ptr<SceneEngine> engine(new SceneEngine(command, camera));
  engine->scene_ = is_path(command) && gpu == nullptr ? engine->host_.scene(view) : make_scene_view(view);
  if (!is_path(command)) {
    engine->work_ = std::make_unique<StudioWork>(engine->scene_, camera, command.render, gpu);
    return engine;
  }
  const PathOptions options = command.paths.options(command.render);
  const PathData& data = command.paths.data();
  if (gpu != nullptr) {
    auto made = GpuPathTracer::make(*gpu, data, settings_of(options, camera));
    if (!made) return tl::unexpected(std::move(made.error()));
    engine->on_gpu_ = std::move(*made);
  }
  engine->work_ =
      std::make_unique<PathWork>(engine->scene_, data, camera, options, engine->on_gpu_ ? &*engine->on_gpu_ : nullptr);
  return engine;
}

build::Result<Image> SceneEngine::layers() { return command_.paths.layers(scene_, camera_, command_.render, {}); }

build::Result<Rendering> render_units(const RenderCommand& command, PictureEngine& engine, const UnitRun& run) {
  auto state = first_state(command, engine.work(), run);
  if (!state) return tl::unexpected(std::move(state.error()));
  PictureHooks hooks;
  hooks.fraction = run.progress;
  hooks.checkpoint_fault = [&](const build::Error& error) {
    if (run.warn) run.warn("the checkpoint is not kept: " + error.message);
  };
  auto rendering =
      is_path(command) ? render_paths(command, engine, run, *state, hooks) : render_studio(engine, run, *state, hooks);
  if (!rendering && rendering.error().code == build::ErrorCode::kBackend)
    rendering.error().message += resume_hint(command.resume);
  return rendering;
}

}  // namespace hiprt::tools
