#pragma once
/// The models as scenes of Vulkan. Vulkan takes many rays at once, so the host makes the test rays.

#include "model.h"

#include <benchmarks/evaluation/competitor.h>
#include <tests/oracle/probe.h>

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace hiprt::bench {

class VulkanScenes {
 public:
  /// @param machine may be nullptr, without modes. @param limit threads that make rays; outlives this.
  VulkanScenes(std::shared_ptr<VulkanMachine> machine, std::vector<std::string> modes, const tools::ThreadLimit& limit)
      : machine_(std::move(machine)), modes_(std::move(modes)), limit_(&limit) {}

  const std::vector<std::string>& modes() const { return modes_; }
  /// Name, driver and calls of the device, or null.
  nlohmann::json describe() const { return machine_ == nullptr ? nlohmann::json() : machine_->describe(); }

  /// Builds the acceleration structures of all modes. The model must outlive their use. @return Vulkan's error.
  build::Result<void> set_model(const Model& model);
  /// Whether the rays of a kind end at their first hit.
  static bool can_check(oracle::CheckKind kind);
  /// Traces the test rays [first, first + count). @pre can_check(probe.kind); the target's pointers are the host's.
  build::Result<oracle::Tally> check(const std::string& mode, const oracle::Probe& probe, std::uint64_t first,
                                     std::uint32_t count);
  /// @return seconds of the device, without copies.
  build::Result<double> trace(const std::string& mode, std::span<const Ray> rays, std::span<Hit> hits);

 private:
  std::shared_ptr<VulkanMachine> machine_;
  std::vector<std::string> modes_;
  const tools::ThreadLimit* limit_;
  Hierarchy model_;  ///< The scenes refer to it.
  std::map<std::string, std::unique_ptr<Competitor>> scenes_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
};

}  // namespace hiprt::bench
