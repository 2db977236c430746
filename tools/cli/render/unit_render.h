#pragma once
/// bvhrender by units of work: for --resume and for several ranks.

#include <tools/cli/render/render_command.h>
#include <tools/render/path/gpu_path_tracer.h>
#include <tools/render/tracers/gpu_tracer.h>
#include <tools/render/units/picture_run.h>

#include <hiprt_build/host/host_part.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace hiprt::tools {

/// What computes the units of a picture in this process.
class PictureEngine {
 public:
  PictureEngine() = default;
  PictureEngine(const PictureEngine&) = delete;
  PictureEngine& operator=(const PictureEngine&) = delete;
  virtual ~PictureEngine() = default;

  virtual PictureWork& work() = 0;
  /// With --integrator path: the picture with all layers but the colours. May run beside work().
  virtual build::Result<Image> layers() = 0;
  /// Called when nobody needs the result of layers(): a call that waits for other processes returns soon.
  virtual void stop_layers() {}
  /// Name of the GPU that traces parts of a scene; empty: none does.
  virtual std::string gpu_name() const { return {}; }
};

/// Of a scene that this process has as a whole.
class SceneEngine : public PictureEngine {
 public:
  /// @param command prepared; it, @p view and @p gpu must live as long as this. @param gpu nullptr: the CPU traces.
  /// @return the errors of GpuPathTracer::make().
  static build::Result<std::unique_ptr<SceneEngine>> make(const RenderCommand& command, const BufferView& view,
                                                          const Camera& camera, GpuTracer* gpu);

  PictureWork& work() override { return *work_; }
  build::Result<Image> layers() override;

 private:
  SceneEngine(const RenderCommand& command, const Camera& camera) : command_(command), camera_(camera) {}

  const RenderCommand& command_;
  Camera camera_;
  HostPart host_;
  SceneView scene_{};
  std::optional<GpuPathTracer> on_gpu_;
  std::unique_ptr<PictureWork> work_;
};

/// Who else takes part in a picture, and what is kept of it.
struct UnitRun {
  Crew* crew = nullptr;
  Checkpoint* checkpoint = nullptr;
  std::function<void(double)> progress{};
  std::function<void(const std::string&)> warn{};
  /// With --integrator path: called with the picture so far after 1, 2, 4, ... seconds.
  std::function<void(const Rendering&)> keep{};
};

/// @return the picture, as render() and PathCommand::render() make it. After an interruption paths have fewer samples;
/// other modes return kCancelled, and so do paths without a sample of every pixel.
build::Result<Rendering> render_units(const RenderCommand& command, PictureEngine& engine, const UnitRun& run);

}  // namespace hiprt::tools
