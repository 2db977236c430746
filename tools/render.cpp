#include "render.h"

#include "heatmap.h"
#include "parallel.h"
#include "render_tile.h"

#include <algorithm>
#include <chrono>
#include <mutex>

namespace hiprt::tools {
namespace {

/// A tile's rays and hits fit into a core's cache, and there are enough tiles for many threads.
constexpr std::uint32_t kTileSize = 32;

/// Adds up what the tiles report.
class Tally {
 public:
  void add(const TileRenderer& tile) {
    const std::lock_guard lock(mutex_);
    rays_.primary += tile.counts().primary;
    rays_.shadow += tile.counts().shadow;
    refused_ = refused_ || tile.failed();
  }
  const RayCounts& rays() const { return rays_; }
  bool failed() const { return refused_; }

 private:
  std::mutex mutex_;
  RayCounts rays_;
  bool refused_ = false;
};

Tile tile_at(std::size_t index, const RenderOptions& options) {
  const std::uint32_t columns = (options.width + kTileSize - 1) / kTileSize;
  const std::uint32_t left = static_cast<std::uint32_t>(index % columns) * kTileSize;
  const std::uint32_t top = static_cast<std::uint32_t>(index / columns) * kTileSize;
  return {left, top, std::min(left + kTileSize, options.width), std::min(top + kTileSize, options.height)};
}

}  // namespace

build::Result<Rendering> render(const SceneView& scene, const Camera& camera, const RenderOptions& options,
                                const std::function<void(double)>& progress) {
  const auto start = std::chrono::steady_clock::now();
  Image image(options.width, options.height);
  std::vector<float> cost(options.mode == RenderMode::kHeatmap ? image.pixels.size() : 0);
  const RenderJob job{scene, options, CameraRays(camera, options.width, options.height), Studio(camera)};
  const std::size_t columns = (options.width + kTileSize - 1) / kTileSize;
  const std::size_t rows = (options.height + kTileSize - 1) / kTileSize;
  Tally tally;
  const ThreadLimit limit(options.threads);
  const bool complete = parallel_batches(
      columns * rows, 1, limit,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          TileRenderer tile(job, tile_at(i, options), image, cost);
          tile.run();
          tally.add(tile);
        }
      },
      progress);
  if (!complete) return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled, nothing was written"});
  if (tally.failed())
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, "the scene has features that this tracer was not compiled for"});
  if (options.mode == RenderMode::kHeatmap) apply_heatmap(image, cost);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  return Rendering{std::move(image), tally.rays(), limit.threads(), seconds.count()};
}

}  // namespace hiprt::tools
