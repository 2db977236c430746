#pragma once
/// The steps of a wave of paths, each over an array of them: rays lie in queues, and between two steps they are traced.
/// After Laine, Karras and Aila, "Megakernels considered harmful: wavefront path tracing on GPUs" (HPG 2013).

#include <tools/render/path/path_batch.h>
#include <tools/render/path/path_bsdf.h>
#include <tools/render/path/path_lights.h>
#include <tools/render/studio/sampler.h>

#include <hiprt_device/math/atomic.h>
#include <hiprt_device/math/vec_functions.h>
#include <hiprt_device/query/spawn.h>

namespace hiprt::tools {

/// State of a path. Its number is pixel * samples + sample, so that neighbouring lanes trace samples of one pixel:
/// they diverge later than samples of neighbouring pixels.
struct PathState {
  Vec3 throughput;
  float density;  ///< Probability density of the last direction; 0: the camera's ray.
  Vec3 radiance;
};

/// Entries of the queues.
struct PathCounts {
  std::uint32_t rays, shadows;
  std::uint32_t failed;  ///< Rays that Hit::failed() is true of.
};

/// All of a wave's memory.
struct PathQueues {
  PathState* states;
  PathCounts* counts;
  // The rays at hand, of path path[i].
  Ray* rays;
  std::uint32_t* path;
  Hit* hits;
  std::uint32_t* instance_paths;  ///< SceneView::levels per ray (instance_paths.h).
  // The rays of the next bounce.
  Ray* next_rays;
  std::uint32_t* next_path;
  // Rays to lights. Without a hit the light arrives.
  Ray* shadow_rays;
  std::uint32_t* shadow_path;
  Hit* shadow_hits;
  Vec3* shadow_light;
};

/// What a step works on.
struct PathJob {
  PathScene scene;
  PathBatch batch;
  PathQueues queues;
  std::uint32_t bounce;  ///< 0: the rays are the camera's.
  PathSums sums;         ///< Of the batch's pixels, at least.
};

/// The steps, by name: kernels are asked for by it.
enum class PathStage { kBegin, kShade, kAddLight, kSum };

inline namespace HIPRT_ISA_NAMESPACE {

namespace path_detail {

/// What all steps are made of.
struct Step {
  const PathScene& scene;
  const PathBatch& batch;
  const PathQueues& queues;
  std::uint32_t bounce;
  PathSums sums;

  HIPRT_HD explicit Step(const PathJob& job)
      : scene(job.scene), batch(job.batch), queues(job.queues), bounce(job.bounce), sums(job.sums) {}
};

struct Pixel {
  std::uint32_t x, y, sample;

  HIPRT_HD Pixel(const PathBatch& batch, std::uint32_t path) : sample(batch.first_sample + path % batch.samples) {
    const std::uint32_t pixel = path / batch.samples;
    const std::uint32_t strip = pixel / (kStrip * batch.width), top = strip * kStrip;
    const std::uint32_t rows = batch.height - top < kStrip ? batch.height - top : kStrip;
    const std::uint32_t within = pixel - top * batch.width;
    x = batch.left + within / rows;
    y = batch.top + top + within % rows;
  }

 private:
  /// Pixels go column by column through strips of so many rows: the lanes of a wave have neighbours in both directions.
  static constexpr std::uint32_t kStrip = 8;
};

}  // namespace path_detail

/// Path i starts at the camera.
struct BeginPaths : path_detail::Step {
  static constexpr PathStage kStage = PathStage::kBegin;
  using Step::Step;

  HIPRT_HD void operator()(std::uint32_t i) const {
    const PathSettings& settings = scene.settings;
    const path_detail::Pixel pixel(batch, i);
    const PixelSampler sampler(pixel.x, pixel.y, settings.seed);
    const auto in_pixel = sampler.point(pixel.sample, SampleUse::kPixel);
    const float part = sampler.point(pixel.sample, SampleUse::kTime)[0];
    Ray ray =
        settings.camera.ray(pixel.x + static_cast<double>(in_pixel[0]), pixel.y + static_cast<double>(in_pixel[1]));
    ray.time = (1.0f - part) * settings.shutter.open + part * settings.shutter.close;
    queues.rays[i] = ray;
    queues.path[i] = i;
    queues.states[i] = {Vec3(1.0f), 0.0f, Vec3(0.0f)};
  }
};

/// The surfaces of hits in the scene of the job.
struct OwnSurfaces {
  /// @param scene of the job. @param path of the hit.
  HIPRT_HD static PathSurface at(std::uint32_t, const PathScene& scene, const Ray& ray, const Hit& hit,
                                 const InstancePath<kTraceLevels>& path) {
    return surface_at(scene, ray, hit, path);
  }
};

/// Light that ray i has met, a ray towards a light, and the path's next ray. Both ways to the same light are weighed by
/// the power heuristic (Veach 1997).
/// @tparam Surfaces what knows the surface of hit i. A surface that emits must be in the scene of the job.
template <class Surfaces> struct Shade : path_detail::Step {
  static constexpr PathStage kStage = PathStage::kShade;

  HIPRT_HD explicit Shade(const PathJob& job, const Surfaces& surfaces = {}) : Step(job), surfaces_(surfaces) {}

  HIPRT_HD void operator()(std::uint32_t i) const {
    const std::uint32_t path = queues.path[i];
    PathState& state = queues.states[path];
    const Ray& ray = queues.rays[i];
    const Hit& hit = queues.hits[i];
    if (hit.failed()) fetch_add(&queues.counts->failed, 1);
    const Lights lights(scene);
    if (!hit.found()) return add_sky(lights, path, ray, state);
    InstancePath<kTraceLevels> instance_path;
    for (std::uint32_t k = 0; k < scene.view.levels; ++k) {
      const std::uint32_t instance = queues.instance_paths[std::uint64_t{i} * scene.view.levels + k];
      if (instance == kInvalidId) break;
      instance_path.instance[instance_path.depth++] = instance;
    }
    const PathSurface surface = surfaces_.at(i, scene, ray, hit, instance_path);
    if (max_component(surface.emission) > 0.0f) {
      const float weight =
          state.density > 0.0f ? weigh(state.density, lights.density(surface, instance_path, ray, hit.t)) : 1.0f;
      state.radiance += state.throughput * surface.emission * weight;
    }
    if (bounce < scene.settings.bounces) go_on(lights, path, ray, hit, surface, state);
  }

 private:
  HIPRT_HD static float weigh(float chosen, float other) {
    const float ratio = other / chosen;
    return 1.0f / (1.0f + ratio * ratio);
  }

  HIPRT_HD void add_sky(const Lights& lights, std::uint32_t path, const Ray& ray, PathState& state) const {
    const PathView<Vec3>& backdrop = scene.arrays.backdrop;
    if (bounce == 0 && backdrop.size != 0) {
      state.radiance += backdrop.data[path_detail::Pixel(batch, path).y];
      return;
    }
    const float weight = state.density > 0.0f ? weigh(state.density, lights.sky_density(ray.direction)) : 1.0f;
    state.radiance += state.throughput * lights.sky().radiance(ray.direction) * weight;
  }

  HIPRT_HD void go_on(const Lights& lights, std::uint32_t path, const Ray& ray, const Hit& hit,
                      const PathSurface& surface, PathState& state) const {
    const path_detail::Pixel pixel(batch, path);
    const PixelSampler sampler(pixel.x, pixel.y, scene.settings.seed);
    const auto point = [&](std::uint32_t use) {
      return sampler.point(pixel.sample,
                           static_cast<SampleUse>(static_cast<std::uint32_t>(SampleUse::kBounce) + 4 * bounce + use));
    };
    const Frame frame(surface.normal);
    const Bsdf bsdf(surface, frame.to_local(-ray.direction));
    const auto choices = point(0);
    if (!lights.empty()) ask_light(lights, path, ray, hit, surface, frame, bsdf, choices[0], point(1), state);
    const auto direction = point(2);
    const auto more = point(3);
    const Vec3 local = bsdf.sample(more[0], direction[0], direction[1]);
    const Vec3 outwards = frame.to_world(local);
    const float density = bsdf.density(local);
    if (!(density > 0.0f && glm::dot(outwards, surface.geometric) > 0.0f)) return;
    Vec3 throughput = state.throughput * (bsdf.value(local) / density);
    // Russian roulette: paths that carry little end.
    constexpr std::uint32_t kSureBounces = 3;
    if (bounce >= kSureBounces) {
      const float most = max_component(throughput), stays = most < 0.95f ? most : 0.95f;
      if (!(more[1] < stays)) return;
      throughput /= stays;
    }
    if (!(max_component(throughput) > 0.0f)) return;
    state.throughput = throughput;
    state.density = density;
    Ray next;
    next.direction = outwards;
    next.origin = spawn_origin(ray, hit, outwards);
    next.time = ray.time;
    const std::uint32_t to = fetch_add(&queues.counts->rays, 1);
    queues.next_rays[to] = next;
    queues.next_path[to] = path;
  }

  HIPRT_HD void ask_light(const Lights& lights, std::uint32_t path, const Ray& ray, const Hit& hit,
                          const PathSurface& surface, const Frame& frame, const Bsdf& bsdf, float choice,
                          const std::array<float, 2>& at, const PathState& state) const {
    const Vec3 from = ray.origin + ray.direction * hit.t;
    const LightSample light = lights.sample(from, ray.time, choice, at[0], at[1]);
    if (!(light.density > 0.0f && glm::dot(light.direction, surface.geometric) > 0.0f)) return;
    const Vec3 local = frame.to_local(light.direction);
    const Vec3 arriving = state.throughput * bsdf.value(local) * light.radiance *
                          (weigh(light.density, bsdf.density(local)) / light.density);
    if (!(max_component(arriving) > 0.0f)) return;
    // The ray ends before the light: by more than rounding errors, and by less than people see.
    constexpr float kUpTo = 1.0f - 0x1p-12f;
    Ray shadow;
    shadow.direction = light.direction;
    shadow.origin = spawn_origin(ray, hit, light.direction);
    shadow.tmax = light.distance * kUpTo;
    shadow.time = ray.time;
    const std::uint32_t to = fetch_add(&queues.counts->shadows, 1);
    queues.shadow_rays[to] = shadow;
    queues.shadow_path[to] = path;
    queues.shadow_light[to] = arriving;
  }

  Surfaces surfaces_;
};
using ShadePaths = Shade<OwnSurfaces>;

/// Adds the light of shadow ray i if the ray has no hit.
struct AddLight : path_detail::Step {
  static constexpr PathStage kStage = PathStage::kAddLight;
  using Step::Step;

  HIPRT_HD void operator()(std::uint32_t i) const {
    const Hit& hit = queues.shadow_hits[i];
    if (hit.failed()) fetch_add(&queues.counts->failed, 1);
    if (!hit.found()) queues.states[queues.shadow_path[i]].radiance += queues.shadow_light[i];
  }
};

/// Pixel i gets its paths' light, in the order of the samples: the same bits whatever the batches are.
struct SumPaths : path_detail::Step {
  static constexpr PathStage kStage = PathStage::kSum;
  using Step::Step;

  HIPRT_HD void operator()(std::uint32_t i) const {
    const path_detail::Pixel at(batch, i * batch.samples);
    PathSum& pixel = sums.at(at.x, at.y);
    for (std::uint32_t s = 0; s < batch.samples; ++s) {
      const Vec3 value = queues.states[i * batch.samples + s].radiance;
      ++pixel.samples;
      // NaN fails too.
      if (!(max_component(value) <= std::numeric_limits<float>::max()) || value.x != value.x || value.y != value.y ||
          value.z != value.z) {
        ++pixel.lost;
        continue;
      }
      pixel.sum += value;
      pixel.squares += value * value;
    }
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::tools
