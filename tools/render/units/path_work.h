#pragma once
/// Path-traced pictures as units of work.

#include <tools/render/path/path_trace.h>
#include <tools/render/units/picture_work.h>

namespace hiprt::tools {

class PathWork : public PictureWork {
 public:
  /// @param data, gpu must live as long as this. @param gpu traces and shades; nullptr: the CPU does.
  PathWork(const SceneView& scene, const PathData& data, const Camera& camera, const PathOptions& options,
           GpuPathTracer* gpu);

  std::uint32_t steps() const override { return samples_; }
  std::size_t pixel_bytes() const override { return sizeof(PathSum); }
  unsigned workers() const override { return gpu_ != nullptr ? 1 : threads_; }
  build::Result<void> enter() override;
  build::Result<RayCounts> run(const PictureUnit& unit, std::span<std::byte> state) override;

 private:
  PathScene scene_;
  bool alpha_cutout_;
  GpuPathTracer* gpu_;
  std::uint32_t samples_;
  unsigned threads_;
};

/// @param states of all pixels of a path-traced picture, row by row; a pixel without a step is zero.
/// @param samples of a whole picture. @return the sums, without rays and times.
PathPicture picture_of(std::span<const std::byte> states, std::uint32_t samples, unsigned threads);

}  // namespace hiprt::tools
