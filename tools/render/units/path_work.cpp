#include <tools/render/units/path_work.h>

#include <tools/base/parallel.h>
#include <tools/render/path/gpu_path_tracer.h>
#include <tools/render/path/path_tile.h>
#include <tools/render/studio/render_tile.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace hiprt::tools {
namespace {

// Ranks and checkpoints exchange the bytes.
static_assert(std::is_trivially_copyable_v<PathSum> && sizeof(PathSum) == 32);

}  // namespace

PathWork::PathWork(const SceneView& scene, const PathData& data, const Camera& camera, const PathOptions& options,
                   GpuPathTracer* gpu)
    : scene_{scene, views(data), settings_of(options, camera)},
      alpha_cutout_(has_alpha_cutout(data)),
      gpu_(gpu),
      samples_(options.samples),
      threads_(ThreadLimit(options.threads).threads()) {}

build::Result<void> PathWork::enter() { return gpu_ != nullptr ? gpu_->make_current() : build::Result<void>(); }

build::Result<RayCounts> PathWork::run(const PictureUnit& unit, std::span<std::byte> state) {
  std::vector<PathSum> sums(unit.pixels());
  if (unit.first != 0) std::memcpy(sums.data(), state.data(), state.size());
  PathBatch part{unit.left, unit.top, unit.width, unit.height, unit.first, unit.steps};
  PathRayCounts rays;
  build::Result<void> done;
  if (gpu_ != nullptr) {
    done = gpu_->load(part, sums);
    if (done) done = trace_on_gpu(*gpu_, part, rays);
    if (done) done = gpu_->download(sums);
  } else {
    const PathSums all{sums.data(), unit.left, unit.top, unit.width};
    for (std::uint32_t x = 0; done && x < unit.width; x += kTileSize) {
      part.left = unit.left + x;
      part.width = std::min(kTileSize, unit.width - x);
      done = trace_tile(scene_, alpha_cutout_, part, all, rays);
    }
  }
  if (done) done = check(rays);
  if (!done) return tl::unexpected(std::move(done.error()));
  std::memcpy(state.data(), sums.data(), state.size());
  const std::uint64_t total = rays.camera + rays.secondary + rays.shadow;
  return RayCounts{rays.camera, rays.shadow, gpu_ != nullptr ? total : 0, rays.secondary};
}

PathPicture picture_of(std::span<const std::byte> states, std::uint32_t samples, unsigned threads) {
  PathPicture picture;
  picture.sums.resize(states.size() / sizeof(PathSum));
  std::memcpy(picture.sums.data(), states.data(), states.size());
  picture.samples = samples;
  for (const PathSum& sum : picture.sums) picture.samples = std::min(picture.samples, sum.samples);
  picture.threads = threads;
  return picture;
}

}  // namespace hiprt::tools
