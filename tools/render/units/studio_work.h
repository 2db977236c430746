#pragma once
/// The modes of bvhrender as units of work.

#include <tools/base/parallel.h>
#include <tools/render/studio/render_tile.h>
#include <tools/render/units/picture_work.h>

namespace hiprt::tools {

class StudioWork : public PictureWork {
 public:
  /// @param scene, options, gpu must live as long as this. @param gpu nullptr: the CPU traces.
  StudioWork(const SceneView& scene, const Camera& camera, const RenderOptions& options, GpuTracer* gpu);

  std::uint32_t steps() const override;
  std::size_t pixel_bytes() const override;
  unsigned workers() const override;
  build::Result<void> enter() override;
  build::Result<RayCounts> run(const PictureUnit& unit, std::span<std::byte> state) override;

  /// @param states of all pixels after all steps, row by row. @return the picture that render() makes, without rays and
  /// times.
  Rendering picture(std::span<const std::byte> states) const;

 private:
  RenderJob job_;
  GpuTracer* gpu_;
  ThreadLimit limit_;
};

}  // namespace hiprt::tools
