#include "vulkan_machine.h"

#include <benchmarks/vulkan/tracer.h>

#include <optional>
#include <utility>

namespace hiprt::bench {
namespace {

class VulkanCompetitor : public Competitor {
 public:
  VulkanCompetitor(const std::string& mode, const Hierarchy& hierarchy, vulkan::Tracer& tracer)
      : Competitor("vulkan", mode, hierarchy),
        tracer_(tracer),
        preference_(mode == "fast_build" ? vulkan::Preference::kFastBuild : vulkan::Preference::kFastTrace) {}

  build::Result<BuildSeconds> build() override {
    if (hierarchy().levels > 1)
      return tl::unexpected(
          build::Error{build::ErrorCode::kNoDevice,
                       std::to_string(hierarchy().levels) + " levels of instances, but Vulkan supports 1"});
    if (!scene_) {
      auto made = hierarchy().levels == 0 ? make_flat() : make_instanced();
      if (!made) return tl::unexpected(std::move(made.error()));
      scene_.emplace(std::move(*made));
    }
    const auto seconds = scene_->build();
    if (!seconds) return tl::unexpected(seconds.error());
    return BuildSeconds{seconds->objects, seconds->instances};
  }

  build::Result<void> prepare() override {
    figures_.built_bytes = scene_->bytes();
    figures_.scratch_bytes = scene_->scratch_bytes();
    const auto seconds = scene_->compact();
    if (!seconds) return tl::unexpected(seconds.error());
    figures_.compaction_seconds = seconds->objects + seconds->instances;
    figures_.bytes = scene_->bytes();
    return {};
  }

  build::Result<double> trace(bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) override {
    auto seconds = tracer_.trace(*scene_, any_hit, rays);
    if (!seconds) return seconds;
    const std::span<const vulkan::VulkanHit> found = tracer_.hits();
    instances_.assign(any_hit || hierarchy().levels == 0 ? 0 : hits.size(), kInvalidId);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      hits[i] = {};
      if (!found[i].found()) continue;
      hits[i].t = found[i].t;
      hits[i].geometry = found[i].geometry;
      hits[i].primitive = found[i].primitive;
      if (!instances_.empty()) instances_[i] = id_of(found[i].instance);
    }
    return seconds;
  }

  std::span<const std::uint32_t> instances() const override { return instances_; }

  TreeFigures figures() const override { return figures_; }
  const SceneView* view() const override { return nullptr; }

 private:
  /// Vulkan traces instances only: one instance of one object.
  build::Result<vulkan::Scene> make_flat() {
    const std::vector<std::vector<build::TriangleMesh>> objects{tools::views(hierarchy().geometries)};
    const build::Instance whole;
    return vulkan::Scene::make(tracer_.device(), preference_, objects, {&whole, 1});
  }

  build::Result<vulkan::Scene> make_instanced() {
    std::vector<std::vector<build::TriangleMesh>> objects;
    for (std::size_t i = 0; i < hierarchy().source->objects.size(); ++i) objects.push_back(hierarchy().object(i));
    return vulkan::Scene::make(tracer_.device(), preference_, objects, hierarchy().groups.back().instances);
  }

  std::uint32_t id_of(std::uint32_t instance) const {
    const std::vector<build::Instance>& all = hierarchy().groups.back().instances;
    return instance < all.size() ? all[instance].id : kInvalidId;
  }

  vulkan::Tracer& tracer_;
  vulkan::Preference preference_;
  std::optional<vulkan::Scene> scene_;
  TreeFigures figures_;
  std::vector<std::uint32_t> instances_;
};

class OpenMachine final : public VulkanMachine {
 public:
  explicit OpenMachine(vulkan::Tracer tracer) : tracer_(std::move(tracer)) {}

  nlohmann::json describe() const override {
    const vulkan::Facts& facts = tracer_.device().facts();
    return {{"device", facts.name},
            {"driver", facts.driver},
            {"calls", facts.calls == vulkan::RayCalls::kQuery ? "query" : "pipeline"}};
  }

  std::unique_ptr<Competitor> compete(const std::string& mode, const Hierarchy& hierarchy) override {
    return std::make_unique<VulkanCompetitor>(mode, hierarchy, tracer_);
  }

 private:
  vulkan::Tracer tracer_;
};

}  // namespace

build::Result<std::shared_ptr<VulkanMachine>> open_vulkan(const VulkanOptions& options) {
  auto device = vulkan::Device::make({options.device, options.calls, options.software});
  if (!device) return tl::unexpected(std::move(device.error()));
  auto tracer = vulkan::Tracer::make(std::move(*device));
  if (!tracer) return tl::unexpected(std::move(tracer.error()));
  return std::make_shared<OpenMachine>(std::move(*tracer));
}

}  // namespace hiprt::bench
