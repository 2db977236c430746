#include <tools/render/path/path_tile.h>

#include <tools/base/errors.h>
#include <tools/base/interrupt.h>
#include <tools/render/path/cpu_path_engine.h>
#include <tools/render/path/gpu_path_tracer.h>
#include <tools/render/path/path_wave.h>

#include <algorithm>
#include <string>

namespace hiprt::tools {
namespace {

/// Samples of a pixel that neighbouring lanes of a GPU trace, if there are so many (decision 0017).
constexpr std::uint32_t kSideBySide = 16;

}  // namespace

build::Result<void> trace_tile(const PathScene& scene, bool alpha_cutout, const PathBatch& part, const PathSums& sums,
                               PathRayCounts& rays) {
  CpuPathEngine engine(scene, alpha_cutout);
  PathBatch batch = part;
  batch.samples = 1;
  auto wave = PathWave<CpuPathEngine>::make(engine, scene, batch.paths());
  if (!wave) return tl::unexpected(std::move(wave.error()));
  for (std::uint32_t s = 0; s < part.samples && !interrupted(); ++s, ++batch.first_sample)
    if (auto done = wave->run(batch, sums, rays); !done) return done;
  return {};
}

build::Result<void> trace_on_gpu(GpuPathTracer& gpu, const PathBatch& part, PathRayCounts& rays,
                                 const std::function<void(double)>& progress) {
  const std::uint32_t side_by_side = std::min(part.samples, kSideBySide);
  const std::uint32_t rows = std::clamp(gpu.capacity() / (part.width * side_by_side), 1u, part.height);
  const std::uint32_t together = std::max(1u, gpu.capacity() / (rows * part.width));
  for (std::uint32_t y = 0; y < part.height; y += rows)
    for (std::uint32_t s = 0; s < part.samples && !interrupted(); s += together) {
      const std::uint32_t height = std::min(rows, part.height - y);
      const PathBatch batch{part.left, part.top + y,          part.width,
                            height,    part.first_sample + s, std::min(together, part.samples - s)};
      if (auto done = gpu.run(batch, rays); !done) return done;
      if (progress) progress(static_cast<double>(y + height) / part.height);
    }
  return {};
}

build::Result<void> check(const PathRayCounts& rays) {
  if (rays.failed == 0) return {};
  return invalid_input(std::to_string(rays.failed) +
                       " rays could not be traced: the tracer does not cover the scene, or its stack is too small");
}

}  // namespace hiprt::tools
