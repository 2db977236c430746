#include <tools/render/parts/part_tracer.h>

#include <tools/base/errors.h>
#include <tools/render/path/cpu_path_engine.h>

#include <utility>

namespace hiprt::tools {

build::Result<std::unique_ptr<PartTracer>> PartTracer::make(build::Buffer bvh, PartData data, std::uint32_t levels,
                                                            const PathSettings& settings) {
  std::unique_ptr<PartTracer> part(new PartTracer);
  part->buffer_ = std::move(bvh);
  const auto view = open_buffer(std::as_const(part->buffer_).bytes());
  if (!view) return invalid_input(to_string(view.error()));
  part->view_ = *view;
  auto arrays = make_path_data(part->view_, data.surfaces ? &*data.surfaces : nullptr, {}, {}, 0.0f);
  if (!arrays) return tl::unexpected(std::move(arrays.error()));
  if (!arrays->lights.empty()) return invalid_input("it has a triangle that emits; only the shared part may have one");
  part->arrays_ = std::move(*arrays);
  part->scene_ = PathScene{part->host_.scene(part->view_), views(part->arrays_), settings};
  part->numbers_ = PathNumbers(part->view_, std::move(data.groups));
  part->levels_ = levels;
  part->alpha_cutout_ = has_alpha_cutout(part->arrays_);
  return part;
}

build::Result<void> PartTracer::move_to(GpuTracer tracer) {
  gpu_ = std::move(tracer);
  auto copied = GpuPathScene::make(*gpu_, arrays_, scene_->settings);
  if (!copied) return tl::unexpected(std::move(copied.error()));
  gpu_scene_ = std::move(*copied);
  return {};
}

build::Result<void> PartTracer::find_hits(Query query, std::span<const Ray> rays, std::span<Hit> hits,
                                          std::span<std::uint32_t> paths) const {
  if (gpu_) {
    const std::lock_guard lock(gpu_mutex_);
    auto done = gpu_->make_current();
    if (!done) return done;
    auto traced = gpu_->trace(query, {}, rays, hits, {}, paths, gpu_scene_->cutout_scene());
    if (!traced) return tl::unexpected(std::move(traced.error()));
    return {};
  }
  const CpuPathEngine engine(*scene_, alpha_cutout_);
  return engine.trace(query, rays.data(), static_cast<std::uint32_t>(rays.size()), hits.data(),
                      paths.empty() ? nullptr : paths.data());
}

build::Result<PartAnswer> PartTracer::trace(Query query, std::span<const Ray> rays) const {
  const PathScene& scene = *scene_;
  const std::uint32_t own_levels = scene.view.levels;
  std::vector<Hit> hits(rays.size());
  std::vector<std::uint32_t> paths(query == Query::kClosest ? rays.size() * own_levels : 0);
  if (auto found = find_hits(query, rays, hits, paths); !found) return tl::unexpected(std::move(found.error()));
  PartAnswer answer;
  answer.query = query;
  answer.results.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit& hit = hits[i];
    answer.results.push_back(hit.failed()  ? VisitResult::kFailed
                             : hit.found() ? VisitResult::kHit
                                           : VisitResult::kMiss);
    if (query == Query::kAny || answer.results.back() != VisitResult::kHit) continue;
    const auto path = std::span(paths).subspan(i * own_levels, own_levels);
    const PathSurface surface = surface_at(scene, rays[i], hit, load_path(path));
    answer.hits.push_back({hit, surface.geometric, surface.normal, surface.base_color, surface.coordinates,
                           surface.metallic, surface.roughness});
    answer.paths.resize(answer.paths.size() + levels_);
    numbers_.to_scene(path, std::span(answer.paths).last(levels_));
  }
  return answer;
}

}  // namespace hiprt::tools
