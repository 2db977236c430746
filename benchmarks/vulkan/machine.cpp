#include "machine.h"

#include "tracer.h"

#include <utility>

namespace hiprt::bench {
namespace {

class OpenScene final : public VulkanScene {
 public:
  OpenScene(vulkan::Scene scene, vulkan::Tracer& tracer) : scene_(std::move(scene)), tracer_(tracer) {}

  build::Result<VulkanSeconds> build() override { return scene_.build(); }
  build::Result<VulkanSeconds> compact() override { return scene_.compact(); }
  VulkanBytes bytes() const override { return scene_.bytes(); }
  build::Result<std::vector<double>> trace(bool any_hit, std::span<const Ray> rays, unsigned times) override {
    return tracer_.trace(scene_, any_hit, rays, times);
  }
  std::span<const VulkanHit> hits() const override { return tracer_.hits(); }

 private:
  vulkan::Scene scene_;
  vulkan::Tracer& tracer_;
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

  build::Result<std::unique_ptr<VulkanScene>> make_scene(const VulkanInput& input) override {
    auto scene = vulkan::Scene::make(tracer_.device(), input);
    if (!scene) return tl::unexpected(std::move(scene.error()));
    return std::make_unique<OpenScene>(std::move(*scene), tracer_);
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
