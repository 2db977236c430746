#include "competitor.h"

#include <utility>

namespace hiprt::bench {
namespace {

class VulkanCompetitor : public Competitor {
 public:
  VulkanCompetitor(const std::string& mode, const Hierarchy& hierarchy, std::shared_ptr<VulkanMachine> machine)
      : Competitor("vulkan", mode, hierarchy), machine_(std::move(machine)) {}

  build::Result<BuildSeconds> build() override {
    if (hierarchy().levels > 1)
      return tl::unexpected(
          build::Error{build::ErrorCode::kNoDevice,
                       std::to_string(hierarchy().levels) + " levels of instances, but Vulkan supports 1"});
    if (scene_ == nullptr) {
      auto made = hierarchy().levels == 0 ? make_flat() : make_instanced();
      if (!made) return tl::unexpected(std::move(made.error()));
      scene_ = std::move(*made);
    }
    const auto seconds = scene_->build();
    if (!seconds) return tl::unexpected(seconds.error());
    return BuildSeconds{seconds->objects, seconds->instances};
  }

  build::Result<void> prepare() override {
    const auto seconds = scene_->compact();
    if (!seconds) return tl::unexpected(seconds.error());
    const VulkanBytes bytes = scene_->bytes();
    figures_ = {.bytes = bytes.now,
                .sah_cost = {},
                .built_bytes = bytes.built,
                .scratch_bytes = bytes.scratch,
                .compaction_seconds = seconds->all()};
    return {};
  }

  build::Result<double> trace(bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) override {
    const auto seconds = scene_->trace(any_hit, rays, 1);
    if (!seconds) return tl::unexpected(seconds.error());
    const std::span<const VulkanHit> found = scene_->hits();
    instances_.assign(any_hit || hierarchy().levels == 0 ? 0 : hits.size(), kInvalidId);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      hits[i] = {};
      if (!found[i].found()) continue;
      hits[i].t = found[i].t;
      hits[i].geometry = found[i].geometry;
      hits[i].primitive = found[i].primitive;
      if (!instances_.empty()) instances_[i] = id_of(found[i].instance);
    }
    return seconds->front();
  }

  std::span<const std::uint32_t> instances() const override { return instances_; }

  TreeFigures figures() const override { return figures_; }
  const SceneView* view() const override { return nullptr; }

 private:
  /// Vulkan traces instances only: one instance of one object.
  build::Result<std::unique_ptr<VulkanScene>> make_flat() {
    const std::vector<std::vector<build::TriangleMesh>> objects{tools::views(hierarchy().geometries)};
    const build::Instance whole;
    return machine_->make_scene({builder(), objects, {&whole, 1}});
  }

  build::Result<std::unique_ptr<VulkanScene>> make_instanced() {
    std::vector<std::vector<build::TriangleMesh>> objects;
    for (std::size_t i = 0; i < hierarchy().source->objects.size(); ++i) objects.push_back(hierarchy().object(i));
    return machine_->make_scene({builder(), objects, hierarchy().groups.back().instances});
  }

  std::uint32_t id_of(std::uint32_t instance) const {
    const std::vector<build::Instance>& all = hierarchy().groups.back().instances;
    return instance < all.size() ? all[instance].id : kInvalidId;
  }

  std::shared_ptr<VulkanMachine> machine_;
  std::unique_ptr<VulkanScene> scene_;
  TreeFigures figures_;
  std::vector<std::uint32_t> instances_;
};

}  // namespace

std::unique_ptr<Competitor> make_vulkan(const std::string& mode, const Hierarchy& hierarchy,
                                        std::shared_ptr<VulkanMachine> machine) {
  return std::make_unique<VulkanCompetitor>(mode, hierarchy, std::move(machine));
}

}  // namespace hiprt::bench
