#include <tools/render/studio/render.h>

#include <tools/base/parallel.h>
#include <tools/render/studio/heatmap.h>
#include <tools/render/studio/render_batches.h>
#include <tools/render/studio/render_tile.h>

#include <hiprt_build/format/out_of_memory.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <numeric>
#include <vector>

namespace hiprt::tools {
namespace {

/// Tiles whose rays go to a GPU together: half a million pixels, in about 150 MB of rays, hits and sums.
constexpr std::size_t kTilesTogether = 512;

/// Adds up what the tiles report.
class Tally {
 public:
  void add(const TileRenderer& tile) {
    const std::lock_guard lock(mutex_);
    rays_.primary += tile.counts().primary;
    rays_.shadow += tile.counts().shadow;
    refused_ = refused_ || tile.failed();
  }
  void add_on_gpu(std::uint64_t rays) { rays_.on_gpu += rays; }
  const RayCounts& rays() const { return rays_; }
  bool failed() const { return refused_; }

 private:
  std::mutex mutex_;
  RayCounts rays_;
  bool refused_ = false;
};

/// The picture that is being made.
struct TiledPicture {
  explicit TiledPicture(const RenderOptions& options)
      : image(options.width, options.height),
        cost(options.mode == RenderMode::kHeatmap ? image.pixels.size() : 0),
        columns((options.width + kTileSize - 1) / kTileSize),
        tiles(std::size_t{columns} * ((options.height + kTileSize - 1) / kTileSize)) {}

  Image image;
  std::vector<float> cost;
  std::uint32_t columns;
  std::size_t tiles;
};

TileRenderer make_tile(const RenderJob& job, TiledPicture& picture, std::size_t index) {
  const std::uint32_t left = static_cast<std::uint32_t>(index % picture.columns) * kTileSize;
  const std::uint32_t top = static_cast<std::uint32_t>(index / picture.columns) * kTileSize;
  const Tile tile{left, top, std::min(left + kTileSize, job.options.width),
                  std::min(top + kTileSize, job.options.height)};
  return TileRenderer(job, tile, {picture.image.pixels, picture.cost, 0, 0, picture.image.width});
}

build::Result<void> render_on_cpu(const RenderJob& job, TiledPicture& picture, Tally& tally, const ThreadLimit& limit,
                                  const std::function<void(double)>& progress) {
  const auto render_tiles = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      TileRenderer tile = make_tile(job, picture, i);
      tile.run(0, TileRenderer::passes(job.options));
      tally.add(tile);
    }
  };
  if (parallel_batches(picture.tiles, 1, limit, render_tiles, progress)) return {};
  return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled, nothing was written"});
}

build::Result<void> render_on_gpu(GpuTracer& gpu, const RenderJob& job, TiledPicture& picture, Tally& tally,
                                  const ThreadLimit& limit, const std::function<void(double)>& progress) {
  for (std::size_t begin = 0; begin < picture.tiles; begin += kTilesTogether) {
    const std::size_t count = std::min(kTilesTogether, picture.tiles - begin);
    std::vector<TileRenderer> tiles;
    tiles.reserve(count);
    for (std::size_t i = 0; i < count; ++i) tiles.push_back(make_tile(job, picture, begin + i));
    const auto report = [&](double done) {
      const double finished = static_cast<double>(begin) + done * static_cast<double>(count);
      if (progress) progress(finished / static_cast<double>(picture.tiles));
    };
    const auto on_gpu = render_together(gpu, job, tiles, {0, TileRenderer::passes(job.options)}, limit, report);
    if (!on_gpu) return tl::unexpected(on_gpu.error());
    for (const TileRenderer& tile : tiles) tally.add(tile);
    tally.add_on_gpu(*on_gpu);
  }
  return {};
}

}  // namespace

build::Result<Rendering> render(const SceneView& scene, const Camera& camera, const RenderOptions& options,
                                const std::function<void(double)>& progress, GpuTracer* gpu) try {
  const auto start = std::chrono::steady_clock::now();
  TiledPicture picture(options);
  picture.image.has_instances = scene.levels != 0;
  const RenderJob job{scene, options, CameraRays(camera, options.width, options.height), Studio(camera)};
  Tally tally;
  const ThreadLimit limit(options.threads);
  const auto done = gpu != nullptr ? render_on_gpu(*gpu, job, picture, tally, limit, progress)
                                   : render_on_cpu(job, picture, tally, limit, progress);
  if (!done) return tl::unexpected(done.error());
  if (tally.failed())
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, "the scene has features that this tracer was not compiled for"});
  if (options.mode == RenderMode::kHeatmap) apply_heatmap(picture.image, picture.cost);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const double steps = std::accumulate(picture.cost.begin(), picture.cost.end(), 0.0);
  return Rendering{
      std::move(picture.image), tally.rays(),
      limit.threads(),          seconds.count(),
      options.samples,          steps / static_cast<double>(std::max<std::size_t>(picture.cost.size(), 1))};
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(build::out_of_memory({"for the picture"}, failure));
}

}  // namespace hiprt::tools
