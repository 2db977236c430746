#pragma once
/// bvhrender --integrator path: options and rendering.

#include <tools/render/path/path_trace.h>
#include <tools/render/studio/render.h>

#include <hiprt_build/format/view.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace hiprt::tools {

class ProgressBar;

class PathCommand {
 public:
  void add_options(CLI::App& app);

  /// Checks options that need each other. Call it when all options are parsed. @throw CLI::ValidationError for options
  /// that need --integrator path.
  void check(const CLI::App& app) const;

  bool chosen() const { return !integrator_.empty(); }

  /// Reads materials and the sky. Call it before long work.
  /// @param bvh validated. @param outputs files that will be written. They must not be inputs. @param warn called with
  /// what the files have and the renderer ignores.
  /// @return the errors of load_surfaces(), read_exr_colors() and make_path_data().
  build::Result<void> prepare(const BufferView& bvh, const Camera& camera, const RenderOptions& options,
                              const std::vector<std::string>& outputs,
                              const std::function<void(const std::string&)>& warn);

  /// The same for a scene in parts, which has its materials: only the sky.
  /// @return kInvalidInput if --materials was given; the errors of read_exr_colors().
  build::Result<void> prepare_sky(const Camera& camera, const RenderOptions& options,
                                  const std::vector<std::string>& outputs);

  const PathData& data() const { return *data_; }
  /// Takes what prepare() of another rank has read.
  void set_data(PathData data) { data_ = std::move(data); }
  PathOptions options(const RenderOptions& options) const;
  std::uint32_t bounces() const { return bounces_; }

  /// The picture with the layers that all modes have; the colours come later. Without layers in @p options it is empty.
  build::Result<Image> layers(const SceneView& scene, const Camera& camera, RenderOptions options,
                              const std::function<void(double)>& progress) const;

  /// @param gpu with the scene on it; nullptr: the CPU traces and shades.
  /// @param keep called with the picture so far after 1, 2, 4, ... seconds.
  /// @return the picture. After an interruption it has fewer samples (Rendering::samples). kCancelled: it has none.
  build::Result<Rendering> render(const BufferView& bvh, const Camera& camera, const RenderOptions& options,
                                  GpuTracer* gpu, ProgressBar& bar,
                                  const std::function<void(const Rendering&)>& keep) const;

  /// Writes the samples so far into the rendering.
  static void take(const PathPicture& picture, bool on_gpu, Rendering& rendering);

 private:
  build::Result<void> read_sky(const Camera& camera, const RenderOptions& options, PathSky& sky,
                               std::vector<Vec3>& behind) const;

  std::string integrator_, environment_;
  std::vector<std::string> materials_;
  std::uint32_t bounces_ = 8;
  std::optional<PathData> data_;
};

}  // namespace hiprt::tools
