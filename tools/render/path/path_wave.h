#pragma once
/// Traces a batch of paths from the camera to their ends: the order of the steps, for any engine that runs them.

#include <tools/render/path/path_stages.h>
#include <tools/render/tracers/tracer.h>

#include <hiprt_build/error.h>

#include <utility>

namespace hiprt::tools {

/// @tparam Engine has
///     Array<T>                                          memory, with data()
///     array<T>(count) -> Result<Array<T>>
///     for_each<Stage>(count, job) -> Result<void>       Stage(job)(i) for all i below count, in any order
///     trace(query, rays, count, hits, instance_paths) -> Result<void>
///     read(counts) -> Result<PathCounts>                after all earlier steps
///     clear(counts) -> Result<void>
template <class Engine> class PathWave {
  template <class T> using Array = typename Engine::template Array<T>;

 public:
  /// @param paths the most paths of a batch.
  static build::Result<PathWave> make(Engine& engine, const PathScene& scene, std::uint32_t paths) {
    PathWave wave(engine, scene);
    build::Result<void> done;
    const auto take = [&]<class T>(Array<T>& array, std::uint64_t count) {
      if (!done) return;
      auto made = engine.template array<T>(count);
      if (made)
        array = std::move(*made);
      else
        done = tl::unexpected(std::move(made.error()));
    };
    take(wave.states_, paths);
    take(wave.counts_, 1);
    for (auto* rays : {&wave.rays_, &wave.next_rays_, &wave.shadow_rays_}) take(*rays, paths);
    for (auto* numbers : {&wave.path_, &wave.next_path_, &wave.shadow_path_}) take(*numbers, paths);
    take(wave.hits_, paths);
    take(wave.shadow_hits_, paths);
    take(wave.instance_paths_, std::uint64_t{paths} * scene.view.levels);
    take(wave.shadow_light_, paths);
    if (!done) return tl::unexpected(std::move(done.error()));
    return wave;
  }

  /// @param sums of the batch's pixels or more, in the engine's memory.
  build::Result<void> run(const PathBatch& batch, const PathSums& sums, PathRayCounts& rays) {
    std::uint32_t count = batch.paths();
    rays.camera += count;
    auto done = engine_->template for_each<BeginPaths>(count, job(batch, 0, sums));
    for (std::uint32_t bounce = 0; done && count != 0; ++bounce) {
      auto counts = step(job(batch, bounce, sums), count);
      if (!counts) return tl::unexpected(std::move(counts.error()));
      rays.shadow += counts->shadows;
      rays.secondary += counts->rays;
      rays.failed += counts->failed;
      count = counts->rays;
      std::swap(rays_, next_rays_);
      std::swap(path_, next_path_);
    }
    if (!done) return done;
    return engine_->template for_each<SumPaths>(batch.pixels(), job(batch, 0, sums));
  }

 private:
  PathWave(Engine& engine, const PathScene& scene) : engine_(&engine), scene_(&scene) {}

  PathQueues queues() {
    return {states_.data(),      counts_.data(),         rays_.data(),        path_.data(),
            hits_.data(),        instance_paths_.data(), next_rays_.data(),   next_path_.data(),
            shadow_rays_.data(), shadow_path_.data(),    shadow_hits_.data(), shadow_light_.data()};
  }

  PathJob job(const PathBatch& batch, std::uint32_t bounce, const PathSums& sums) {
    return {*scene_, batch, queues(), bounce, sums};
  }

  /// @return the new lengths of the queues.
  build::Result<PathCounts> step(const PathJob& work, std::uint32_t count) {
    auto done = engine_->trace(Query::kClosest, rays_.data(), count, hits_.data(), instance_paths_.data());
    if (done) done = engine_->clear(counts_);
    if (done) done = engine_->template for_each<ShadePaths>(count, work);
    if (!done) return tl::unexpected(std::move(done.error()));
    auto counts = engine_->read(counts_);
    if (!counts || counts->shadows == 0) return counts;
    done = engine_->trace(Query::kAny, shadow_rays_.data(), counts->shadows, shadow_hits_.data(), nullptr);
    if (done) done = engine_->template for_each<AddLight>(counts->shadows, work);
    if (!done) return tl::unexpected(std::move(done.error()));
    return counts;
  }

  Engine* engine_;
  const PathScene* scene_;
  Array<PathState> states_;
  Array<PathCounts> counts_;
  Array<Ray> rays_, next_rays_, shadow_rays_;
  Array<std::uint32_t> path_, next_path_, shadow_path_, instance_paths_;
  Array<Hit> hits_, shadow_hits_;
  Array<Vec3> shadow_light_;
};

}  // namespace hiprt::tools
