#include <tools/render/units/studio_work.h>

#include <tools/base/errors.h>
#include <tools/render/studio/heatmap.h>
#include <tools/render/studio/render_batches.h>
#include <tools/render/studio/render_tile.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <vector>

namespace hiprt::tools {
namespace {

struct StudioPixel {
  Pixel pixel;
  SkyLight light;
  float cost = 0.0f;
};
// Ranks and checkpoints exchange the bytes.
static_assert(std::is_trivially_copyable_v<StudioPixel> && sizeof(StudioPixel) == 116);

/// The pixels of a unit, and the tiles that compute them.
class UnitPixels {
 public:
  UnitPixels(const RenderJob& job, const PictureUnit& unit)
      : unit_(unit), pixels_(unit.pixels()), cost_(job.options.mode == RenderMode::kHeatmap ? unit.pixels() : 0) {
    const TilePixels all{pixels_, cost_, unit.left, unit.top, unit.width};
    const std::uint32_t right = unit.left + unit.width, bottom = unit.top + unit.height;
    for (std::uint32_t top = unit.top; top < bottom; top += kTileSize)
      for (std::uint32_t left = unit.left; left < right; left += kTileSize) {
        const Tile tile{left, top, std::min(left + kTileSize, right), std::min(top + kTileSize, bottom)};
        bounds_.push_back(tile);
        tiles_.emplace_back(job, tile, all);
      }
  }

  std::span<TileRenderer> tiles() { return tiles_; }

  void load(std::span<const std::byte> state) {
    for_each([&](std::size_t i, SkyLight& light) {
      StudioPixel pixel;
      std::memcpy(&pixel, state.data() + i * sizeof(pixel), sizeof(pixel));
      pixels_[i] = pixel.pixel;
      light = pixel.light;
      if (!cost_.empty()) cost_[i] = pixel.cost;
    });
  }

  void store(std::span<std::byte> state) {
    for_each([&](std::size_t i, const SkyLight& light) {
      const StudioPixel pixel{pixels_[i], light, cost_.empty() ? 0.0f : cost_[i]};
      std::memcpy(state.data() + i * sizeof(pixel), &pixel, sizeof(pixel));
    });
  }

 private:
  /// Calls body(index of the pixel in the unit, its light).
  template <class Body> void for_each(Body&& body) {
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      const Tile& tile = bounds_[t];
      const auto light = tiles_[t].sky_light();
      std::size_t next = 0;
      for (std::uint32_t y = tile.top; y < tile.bottom; ++y)
        for (std::uint32_t x = tile.left; x < tile.right; ++x)
          body(std::size_t{y - unit_.top} * unit_.width + (x - unit_.left), light[next++]);
    }
  }

  PictureUnit unit_;
  std::vector<Pixel> pixels_;
  std::vector<float> cost_;
  std::vector<Tile> bounds_;
  std::vector<TileRenderer> tiles_;
};

}  // namespace

StudioWork::StudioWork(const SceneView& scene, const Camera& camera, const RenderOptions& options, GpuTracer* gpu)
    : job_{scene, options, CameraRays(camera, options.width, options.height), Studio(camera)},
      gpu_(gpu),
      limit_(options.threads) {}

std::uint32_t StudioWork::steps() const { return TileRenderer::passes(job_.options); }
std::size_t StudioWork::pixel_bytes() const { return sizeof(StudioPixel); }
unsigned StudioWork::workers() const { return gpu_ != nullptr ? 1 : limit_.threads(); }

build::Result<void> StudioWork::enter() { return gpu_ != nullptr ? gpu_->make_current() : build::Result<void>(); }

build::Result<RayCounts> StudioWork::run(const PictureUnit& unit, std::span<std::byte> state) {
  UnitPixels pixels(job_, unit);
  if (unit.first != 0) pixels.load(state);
  const PassRange range{unit.first, unit.first + unit.steps};
  RayCounts rays;
  if (gpu_ != nullptr) {
    const auto on_gpu = render_together(*gpu_, job_, pixels.tiles(), range, limit_, {});
    if (!on_gpu) return tl::unexpected(on_gpu.error());
    rays.on_gpu = *on_gpu;
  } else {
    for (TileRenderer& tile : pixels.tiles()) tile.run(range.first, range.end);
  }
  for (const TileRenderer& tile : pixels.tiles()) {
    if (tile.failed()) return invalid_input("the scene has features that this tracer was not compiled for");
    rays.primary += tile.counts().primary;
    rays.shadow += tile.counts().shadow;
  }
  pixels.store(state);
  return rays;
}

Rendering StudioWork::picture(std::span<const std::byte> states) const {
  const RenderOptions& options = job_.options;
  Image image(options.width, options.height);
  image.has_instances = job_.scene.levels != 0;
  std::vector<float> cost(options.mode == RenderMode::kHeatmap ? image.pixels.size() : 0);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    StudioPixel pixel;
    std::memcpy(&pixel, states.data() + i * sizeof(pixel), sizeof(pixel));
    image.pixels[i] = pixel.pixel;
    if (!cost.empty()) cost[i] = pixel.cost;
  }
  if (!cost.empty()) apply_heatmap(image, cost);
  const double sum = std::accumulate(cost.begin(), cost.end(), 0.0);
  Rendering rendering{std::move(image), {}, limit_.threads(), 0.0, options.samples, 0.0};
  if (!cost.empty()) rendering.mean_steps = sum / static_cast<double>(cost.size());
  return rendering;
}

}  // namespace hiprt::tools
