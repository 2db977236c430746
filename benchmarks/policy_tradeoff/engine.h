#pragma once
/// Traces by policy sets, by Embree on the threads of the CPU, and by Vulkan on a GPU.

#include "embree_scenes.h"
#include "kernels.h"
#include "model.h"
#include "subject.h"
#include "vulkan_scenes.h"

#include <benchmarks/engine/device.h>

#include <nlohmann/json.hpp>

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace hiprt::bench {

struct InstancedSphere;

class Engine {
 public:
  /// @param name "cpu" or "gpu". @param threads of the CPU; 0: all. @param vulkan is moved.
  /// @return kInvalidInput if the processor lacks AVX2 or FMA, kNoDevice without a GPU or GPU code.
  static build::Result<std::unique_ptr<Engine>> make(std::string_view name, unsigned threads, VulkanScenes vulkan);

  bool is_gpu() const { return is_gpu_; }
  nlohmann::json describe() const { return device_->describe(); }
  nlohmann::json describe_vulkan() const { return vulkan_.describe(); }
  const std::vector<Subject>& subjects() const { return subjects_; }

  /// Selects the model that the following calls trace. Model and trees must outlive their use.
  build::Result<void> set_model(const Model& model, const Trees& trees);
  /// Selects a mesh that is seen through instances, until the next set_model().
  build::Result<void> set_sphere(const InstancedSphere& sphere);
  /// Whether the subject can trace the instances of set_sphere().
  bool can_trace_sphere(const Subject& subject) const;

  /// Checks rays [0, count) of a probe. The engine sets the probe's target.
  /// @pre probe.kind != CheckKind::kTrace; for Vulkan VulkanScenes::can_check()
  build::Result<Tally> check(const Subject& subject, Probe probe, std::uint64_t count);
  /// Traces rays[i] into hits[i] (closest hit). @return seconds without copies.
  build::Result<double> trace(const Subject& subject, std::span<const Ray> rays, std::span<Hit> hits);

 private:
  Engine(std::unique_ptr<Device> device, bool is_gpu, VulkanScenes vulkan);

  build::Result<LoadedScene> load(const build::Buffer& file);
  build::Result<void> set_mesh(const Model& model);
  build::Result<void> set_rays(std::span<const Ray> rays);
  Kernels kernels(const Subject& subject) const;
  Work make_work(const Subject& subject, const Probe& probe) const;
  /// The part of a probe's target that all tracers share, with the host's pointers.
  Target host_target() const;
  /// Checks rays [work.first, work.first + work.count).
  build::Result<Tally> check_part(const Subject& subject, Work& work);

  std::unique_ptr<Device> device_;
  bool is_gpu_;
  std::vector<Subject> subjects_;
  const Model* model_ = nullptr;
  std::array<LoadedScene, kLayouts> scenes_;
  std::optional<LoadedScene> instanced_;  ///< Of set_sphere().
  EmbreeScenes embree_;                   ///< Empty with a GPU.
  VulkanScenes vulkan_;
  Array<build::Position> positions_;
  Array<build::Triangle> triangles_;
  Array<std::uint32_t> tally_;
  const Ray* host_rays_ = nullptr;  ///< That rays_ is a copy of.
  Array<Ray> rays_;
  Array<Hit> hits_;
};

}  // namespace hiprt::bench
