#include <tools/render/path/path_trace.h>

#include <tools/base/interrupt.h>
#include <tools/base/parallel.h>
#include <tools/render/image/image.h>
#include <tools/render/path/cpu_path_engine.h>
#include <tools/render/path/gpu_path_tracer.h>
#include <tools/render/path/path_tile.h>
#include <tools/render/studio/render_tile.h>

#include <hiprt_build/exec/stopwatch.h>
#include <hiprt_build/format/out_of_memory.h>

#include <algorithm>
#include <mutex>

namespace hiprt::tools {
namespace {

/// Samples between two looks at the picture, at most.
constexpr std::uint32_t kMostSamplesOfPass = 64;

/// Some samples of all pixels.
class Pass {
 public:
  Pass(const PathScene& scene, bool alpha_cutout, PathPicture& picture)
      : scene_(scene), alpha_cutout_(alpha_cutout), picture_(picture) {}

  build::Result<void> on_cpu(std::uint32_t first, std::uint32_t samples, const ThreadLimit& limit,
                             const std::function<void(double)>& progress) {
    const PathSettings& settings = scene_.settings;
    const std::uint32_t columns = (settings.width + kTileSize - 1) / kTileSize;
    const std::uint32_t rows = (settings.height + kTileSize - 1) / kTileSize;
    build::Result<void> result;
    const auto take_tile = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t left = static_cast<std::uint32_t>(i % columns) * kTileSize;
        const std::uint32_t top = static_cast<std::uint32_t>(i / columns) * kTileSize;
        PathRayCounts rays;
        const PathBatch tile{
            left,  top,    std::min(kTileSize, settings.width - left), std::min(kTileSize, settings.height - top),
            first, samples};
        auto done = trace_tile(scene_, alpha_cutout_, tile, {picture_.sums.data(), 0, 0, settings.width}, rays);
        const std::lock_guard lock(mutex_);
        picture_.rays += rays;
        if (!done && result) result = std::move(done);
      }
    };
    parallel_batches(std::size_t{columns} * rows, 1, limit, take_tile, progress);
    return result;
  }

  build::Result<void> on_gpu(GpuPathTracer& gpu, std::uint32_t first, std::uint32_t samples,
                             const std::function<void(double)>& progress) {
    const PathSettings& settings = scene_.settings;
    return trace_on_gpu(gpu, {0, 0, settings.width, settings.height, first, samples}, picture_.rays, progress);
  }

 private:
  const PathScene& scene_;
  bool alpha_cutout_;
  PathPicture& picture_;
  std::mutex mutex_;
};

}  // namespace

PathSettings settings_of(const PathOptions& options, const Camera& camera) {
  return {CameraRays(camera, options.width, options.height),
          options.width,
          options.height,
          options.shutter,
          options.seed,
          options.bounces};
}

build::Result<PathPicture> trace_paths(const SceneView& scene, const PathData& data, const Camera& camera,
                                       const PathOptions& options, const PathProgress& progress,
                                       GpuPathTracer* gpu) try {
  const ThreadLimit limit(options.threads);
  const PathScene paths{scene, views(data), settings_of(options, camera)};
  PathPicture picture;
  picture.threads = limit.threads();
  picture.sums.resize(std::size_t{options.width} * options.height);
  Pass pass(paths, has_alpha_cutout(data), picture);
  build::Stopwatch watch;
  std::uint32_t done = 0;
  while (done < options.samples && !interrupted()) {
    const std::uint32_t count = std::min({std::max(done, 1u), kMostSamplesOfPass, options.samples - done});
    const auto part = [&](double fraction) {
      if (progress.fraction) progress.fraction((done + fraction * count) / options.samples);
    };
    auto passed = gpu != nullptr ? pass.on_gpu(*gpu, done, count, part) : pass.on_cpu(done, count, limit, part);
    if (passed) passed = check(picture.rays);
    if (passed && gpu != nullptr) passed = gpu->download(picture.sums);
    if (!passed) return tl::unexpected(std::move(passed.error()));
    done += count;
    picture.seconds += watch.lap();
    picture.samples = done;
    if (progress.picture && !interrupted() && done < options.samples) progress.picture(picture);
    watch.lap();
  }
  picture.samples = options.samples;
  for (const PathSum& sum : picture.sums) picture.samples = std::min(picture.samples, sum.samples);
  return picture;
} catch (const std::bad_alloc& failure) {
  return tl::unexpected(build::out_of_memory({"for the picture"}, failure));
}

void store(const PathPicture& picture, Image& image) {
  image.shading.resize(image.pixels.size());
  for (std::size_t i = 0; i < picture.sums.size(); ++i) {
    const PathSum& sum = picture.sums[i];
    const float n = static_cast<float>(std::max(sum.samples, 1u));
    const Vec3 mean = sum.sum / n;
    image.pixels[i].color = mean;
    Vec3& variance = image.shading[i].variance;
    Vec3& relative = image.shading[i].relative_variance;
    for (int c = 0; c < 3; ++c) {
      variance[c] = sum.samples > 1 ? std::max(0.0f, (sum.squares[c] - sum.sum[c] * mean[c]) / (n - 1.0f)) : 0.0f;
      relative[c] = mean[c] > 0.0f ? variance[c] / (mean[c] * mean[c]) : 0.0f;
    }
  }
}

build::Result<void> store_surfaces(const SceneView& scene, const PathData& data, const Camera& camera,
                                   const PathOptions& options, Image& image) {
  const ThreadLimit limit(options.threads);
  const PathScene paths{scene, views(data), settings_of(options, camera)};
  const bool alpha_cutout = has_alpha_cutout(data);
  const CpuPathEngine engine(paths, alpha_cutout);
  image.shading.resize(image.pixels.size());
  const auto take_rows = [&](std::size_t begin, std::size_t end) {
    std::vector<Ray> rays(options.width);
    std::vector<Hit> hits(options.width);
    std::vector<std::uint32_t> instance_paths(std::size_t{options.width} * scene.levels);
    for (std::size_t y = begin; y < end; ++y) {
      for (std::uint32_t x = 0; x < options.width; ++x) {
        rays[x] = paths.settings.camera.ray(x + 0.5, static_cast<double>(y) + 0.5);
        rays[x].time = 0.5f * options.shutter.open + 0.5f * options.shutter.close;
      }
      static_cast<void>(engine.trace(Query::kClosest, rays.data(), options.width, hits.data(), instance_paths.data()));
      for (std::uint32_t x = 0; x < options.width; ++x) {
        if (!hits[x].found()) {
          if (alpha_cutout) clear_centre_hit(image.pixels[y * options.width + x]);
          continue;
        }
        const auto instance_path =
            load_path(std::span(instance_paths).subspan(std::size_t{x} * scene.levels, scene.levels));
        const PathSurface surface = surface_at(paths, rays[x], hits[x], instance_path);
        // The picture's other layers are of rays that stop at parts of triangles that are cut out.
        if (alpha_cutout)
          store_centre_hit(rays[x], hits[x], instance_path.depth == 0 ? kInvalidId : instance_path.instance[0],
                           image.pixels[y * options.width + x]);
        ShadingPixel& pixel = image.shading[y * options.width + x];
        pixel.albedo = surface.base_color;
        pixel.normal = surface.normal;
        pixel.u = surface.coordinates.u;
        pixel.v = surface.coordinates.v;
      }
    }
  };
  if (parallel_batches(options.height, 8, limit, take_rows)) return {};
  return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "cancelled"});
}

}  // namespace hiprt::tools
