#include "vulkan_scenes.h"

#include <algorithm>

namespace hiprt::bench {

using oracle::CheckKind, oracle::Probe, oracle::Tally;

build::Result<void> VulkanScenes::set_model(const Model& model) {
  scenes_.clear();
  model_ = {};
  if (modes_.empty()) return {};
  model_.name = "flat";
  tools::FlatGeometry& geometry = model_.geometries.emplace_back();
  geometry.positions = model.mesh.positions;
  geometry.triangles = model.mesh.triangles;
  geometry.mask = ~0u;
  geometry.name = &model.name;
  for (const std::string& mode : modes_) {
    auto scene = make_vulkan(mode, model_, machine_);
    if (auto built = scene->build(); !built) return tl::unexpected(built.error());
    if (auto ready = scene->prepare(); !ready) return ready;
    scenes_.emplace(mode, std::move(scene));
  }
  return {};
}

build::Result<double> VulkanScenes::trace(const std::string& mode, std::span<const Ray> rays, std::span<Hit> hits) {
  // The first launch after one of another interface waits for the GPU to change to Vulkan's context.
  const std::size_t few = std::min<std::size_t>(rays.size(), 64);
  Competitor& scene = *scenes_.at(mode);
  if (auto warm = scene.trace(false, rays.first(few), hits.first(few)); !warm) return warm;
  return scene.trace(false, rays, hits);
}

bool VulkanScenes::can_check(CheckKind kind) {
  return kind == CheckKind::kRandom || kind == CheckKind::kEdge || kind == CheckKind::kVertex;
}

build::Result<Tally> VulkanScenes::check(const std::string& mode, const Probe& probe, std::uint64_t first,
                                         std::uint32_t count) {
  rays_.resize(count);
  hits_.resize(count);
  constexpr std::size_t kBatch = 1u << 14;
  const bool all = tools::parallel_batches(count, kBatch, *limit_, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) rays_[i] = oracle::test_ray(probe, first + i);
  });
  if (!all) return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "interrupted"});
  if (auto traced = trace(mode, rays_, hits_); !traced) return tl::unexpected(traced.error());
  const auto missed = std::count_if(hits_.begin(), hits_.end(), [](const Hit& hit) { return !hit.found(); });
  return Tally{0, static_cast<std::uint64_t>(missed), 0, 0};
}

}  // namespace hiprt::bench
