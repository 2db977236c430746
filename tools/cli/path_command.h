#pragma once
/// bvhrender --integrator path: its options, and what they lead to.

#include <tools/render/path/path_data.h>
#include <tools/render/studio/render.h>

#include <hiprt_build/format/view.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace hiprt::tools {

class ProgressBar;

class PathCommand {
 public:
  void add_options(CLI::App& app);

  /// To be called when all is parsed. @throw CLI::ValidationError for options that need --integrator path.
  void check(const CLI::App& app) const;

  bool chosen() const { return !integrator_.empty(); }

  /// To be called before long work: reads materials and the sky.
  /// @param bvh validated. @param outputs none of them may be read.
  /// @return the errors of load_surfaces(), read_exr_colors() and make_path_data().
  build::Result<void> prepare(const BufferView& bvh, const Camera& camera, const RenderOptions& options,
                              const std::vector<std::string>& outputs);

  /// @param gpu with the scene on it; nullptr: the CPU traces and shades.
  /// @param keep called with what there is, after a second, then two, four, ...; for pictures that take long.
  /// @return the picture, with Rendering::samples below those asked for when interrupted() became true: kCancelled if
  /// there is not even one.
  build::Result<Rendering> render(const BufferView& bvh, const Camera& camera, const RenderOptions& options,
                                  GpuTracer* gpu, ProgressBar& bar,
                                  const std::function<void(const Rendering&)>& keep) const;

 private:
  std::string integrator_, environment_;
  std::vector<std::string> materials_;
  std::uint32_t bounces_ = 8;
  std::optional<PathData> data_;
};

}  // namespace hiprt::tools
