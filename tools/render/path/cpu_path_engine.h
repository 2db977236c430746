#pragma once
/// Runs the steps of a wave of paths on the calling thread.

#include <tools/render/path/path_steps.h>
#include <tools/render/tracers/tracer.h>

#include <hiprt_build/error.h>
#include <hiprt_build/trace_rays.h>
#include <hiprt_device/host_scene.h>

#include <span>
#include <vector>

namespace hiprt::tools {

/// What engines of PathWave that shade on the calling thread have in common.
class HostPathSteps {
 public:
  template <class T> using Array = std::vector<T>;

  template <class T> build::Result<Array<T>> array(std::uint64_t count) const {
    return Array<T>(static_cast<std::size_t>(count));
  }
  template <class Stage> build::Result<void> for_each(std::uint32_t count, const PathJob& job) const {
    run_step(Stage::kStage, job, count);
    return {};
  }
  static build::Result<PathCounts> read(const Array<PathCounts>& counts) { return counts[0]; }
  static build::Result<void> clear(Array<PathCounts>& counts) {
    counts[0] = {};
    return {};
  }
};

/// An engine of PathWave that traces on the calling thread, too.
class CpuPathEngine : public HostPathSteps {
 public:
  CpuPathEngine(const PathScene& scene, bool alpha_cutout) : scene_(scene), alpha_cutout_(alpha_cutout) {}

  build::Result<void> trace(Query query, const Ray* rays, std::uint32_t count, Hit* hits,
                            std::uint32_t* instance_paths) const {
    const std::span<const Ray> from(rays, count);
    const std::span<Hit> to(hits, count);
    const std::span<std::uint32_t> paths(instance_paths,
                                         instance_paths == nullptr ? 0 : std::size_t{count} * scene_.view.levels);
    // Shadow rays only ask whether something blocks them.
    if (query == Query::kAny && !alpha_cutout_ && current_host_scene(scene_.view) != nullptr)
      return any_hits(scene_.view, from, to);
    if (alpha_cutout_)
      hiprt::tools::trace(scene_, query, from, to, paths);
    else
      hiprt::tools::trace(scene_.view, query, {}, from, to, {}, paths);
    return {};
  }

 private:
  const PathScene& scene_;
  bool alpha_cutout_;
};

}  // namespace hiprt::tools
