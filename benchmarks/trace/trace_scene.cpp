#include "trace_scene.h"

#include <algorithm>
#include <cmath>

namespace hiprt::bench {

build::Result<std::unique_ptr<TraceScene>> TraceScene::make(const SceneOptions& options, const std::string& name,
                                                            std::uint32_t wanted_rays) {
  auto scene = load_scene(options, name);
  if (!scene) return tl::unexpected(scene.error());
  auto rays = load_rays(options, *scene, wanted_rays);
  if (!rays) return tl::unexpected(rays.error());
  auto made = std::make_unique<TraceScene>();
  made->name_ = name;
  made->rays_ = std::move(*rays);
  if (auto built = made->build_trees(*scene); !built) return tl::unexpected(built.error());
  if (auto built = made->build_embree(*scene); !built) return tl::unexpected(built.error());
  return made;
}

const RaySet* TraceScene::rays(const std::string& kind) const {
  const auto found = std::find_if(rays_.begin(), rays_.end(), [&](const RaySet& set) { return set.kind == kind; });
  return found == rays_.end() ? nullptr : &*found;
}

float TraceScene::reach() const {
  const Box& bounds = trees_.begin()->second.view.bounds;
  float reach = 0.0f;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max({reach, std::abs(bounds.min[axis]), std::abs(bounds.max[axis])});
  return reach;
}

build::Result<void> TraceScene::build_trees(const Scene& scene) {
  const build::TriangleMesh input = scene.input();
  for (const Variant& variant : kVariants) {
    const std::pair key{variant.layout, variant.builder};
    if (trees_.contains(key)) continue;
    auto bvh = build::build({&input, 1}, {.builder = variant.builder, .nodes = variant.layout});
    if (!bvh) return tl::unexpected(bvh.error());
    const SceneView view = bvh->scene();
    trees_.emplace(key, Tree{std::move(*bvh), view});
  }
  return {};
}

build::Result<void> TraceScene::build_embree(const Scene& scene) {
  for (const RTCSceneFlags flags : {RTC_SCENE_FLAG_ROBUST, RTC_SCENE_FLAG_NONE}) {
    auto made = EmbreeScene::make(scene.mesh, {.flags = flags});
    if (!made) return tl::unexpected(made.error());
    if (auto committed = made->commit(); !committed) return tl::unexpected(committed.error());
    embree_.push_back(std::move(*made));
  }
  return {};
}

}  // namespace hiprt::bench
