#pragma once
/// Vulkan's speed for the scenes and rays of a session, in the form of benchmarks/peers.

#include "check.h"
#include "input.h"

#include <benchmarks/engine/device.h>
#include <benchmarks/vulkan/machine.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace hiprt::bench {

class VulkanPeers {
 public:
  /// @param modes of vulkan_modes().
  VulkanPeers(std::shared_ptr<VulkanMachine> machine, const std::vector<std::string>& modes);

  /// Builds the triangles of a tree in all modes, and compacts the structures. A tree of the last tree's scene changes
  /// nothing, because it has the same triangles.
  /// @return false if there is nothing to measure: that scene was measured before, or notes() says why not.
  bool set_tree(const Tree& tree);
  /// Traces the rays in all modes. @param host results of the same rays. An error becomes one of notes().
  void run(const RayBuffer& rays, std::span<const Ray> traced, const HostResults& host, const Repetitions& repetitions);

  /// What could not be measured.
  const std::vector<std::string>& notes() const { return notes_; }
  bool empty() const;
  /// @param context the commit, the date and the like.
  nlohmann::json to_json(const nlohmann::json& context, const Repetitions& repetitions) const;

 private:
  struct Cell {
    double mrays_s = 0;
    HostResults::Comparison compared;
    bool any_hit = false;
  };
  struct Peer {
    std::string mode;
    std::unique_ptr<VulkanScene> scene;                        ///< nullptr: not measured.
    std::map<std::string, std::map<std::string, Cell>> cells;  ///< By scene and kind.
  };
  build::Result<void> build(const Tree& tree);
  build::Result<void> run(Peer& peer, const RayBuffer& rays, std::span<const Ray> traced, const HostResults& host,
                          const Repetitions& repetitions);
  nlohmann::json peer_json(const Peer& peer) const;

  std::shared_ptr<VulkanMachine> machine_;
  std::vector<Peer> peers_;
  std::string scene_;  ///< The last tree's.
  std::vector<std::string> notes_;
};

}  // namespace hiprt::bench
