#pragma once
/// Vulkan's ray tracing for programs that compare with it. They may have been built without Vulkan's headers: then no
/// machine opens.

#include <benchmarks/common/flags.h>

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/ray.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace hiprt::bench {

/// "fast_build" and "fast_trace": the preferences of builds (VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_*).
std::vector<std::string> vulkan_modes();

/// How shaders trace rays: "auto", "pipeline" or "query" (vulkan::Choice).
std::vector<std::string> vulkan_calls();

struct VulkanOptions {
  std::vector<std::string> modes{"default"};  ///< Of vulkan_modes(). "default": all on a GPU, none on a CPU.
  std::string device;                         ///< A part of the device's name. Empty: the first GPU.
  std::string calls = "auto";                 ///< Of vulkan_calls(). A device that lacks that takes the other one.
  bool software = false;                      ///< Whether drivers that run on the CPU will do.

  /// --vulkan, --vulkan-device and --vulkan-calls.
  std::vector<Flag> flags();
};

/// A hit as Vulkan reports it.
struct VulkanHit {
  float t;                 ///< Infinity: a miss. For any hit: 0 at a hit.
  std::uint32_t instance;  ///< Its number among the scene's instances.
  std::uint32_t geometry;  ///< Mesh of the instance's object.
  std::uint32_t primitive;

  bool found() const { return primitive != kInvalidId; }
};

/// Seconds on the device, from timestamps.
struct VulkanSeconds {
  double objects = 0;    ///< Bottom-level acceleration structures.
  double instances = 0;  ///< The top-level one.

  double all() const { return objects + instances; }
};

/// Bytes of all acceleration structures of a scene.
struct VulkanBytes {
  std::uint64_t now = 0;      ///< Less after compact().
  std::uint64_t built = 0;    ///< Before compact().
  std::uint64_t scratch = 0;  ///< Memory that builds need in addition: the larger of both levels.
};

/// Acceleration structures over objects and their instances. The machine must outlive them.
class VulkanScene {
 public:
  VulkanScene() = default;
  VulkanScene(const VulkanScene&) = delete;
  VulkanScene& operator=(const VulkanScene&) = delete;
  virtual ~VulkanScene() = default;

  /// Builds, and replaces what the last call built. @pre compact() has not been called.
  virtual build::Result<VulkanSeconds> build() = 0;
  /// Copies the structures into less memory. @pre build() has been called, and the scene is compactable.
  virtual build::Result<VulkanSeconds> compact() = 0;
  virtual VulkanBytes bytes() const = 0;
  /// Traces rays[i] @p times and keeps the last result in hits()[i]. @return seconds of each time, without copies.
  virtual build::Result<std::vector<double>> trace(bool any_hit, std::span<const Ray> rays, unsigned times) = 0;
  virtual std::span<const VulkanHit> hits() const = 0;
};

/// What a scene is made of.
struct VulkanInput {
  std::string mode;                                           ///< Of vulkan_modes().
  std::span<const std::vector<build::TriangleMesh>> objects;  ///< The meshes of each object.
  std::span<const build::Instance> instances;                 ///< Of objects. Ids are not used.
  bool compactable = true;                                    ///< Whether compact() will be called.
};

/// A device of Vulkan, for all scenes.
class VulkanMachine {
 public:
  VulkanMachine() = default;
  VulkanMachine(const VulkanMachine&) = delete;
  VulkanMachine& operator=(const VulkanMachine&) = delete;
  virtual ~VulkanMachine() = default;

  /// Its name, driver and calls, for the JSON.
  virtual nlohmann::json describe() const = 0;
  /// Copies the input to the device and allocates all memory.
  virtual build::Result<std::unique_ptr<VulkanScene>> make_scene(const VulkanInput& input) = 0;
};

/// @return kNoDevice with the reason.
build::Result<std::shared_ptr<VulkanMachine>> open_vulkan(const VulkanOptions& options);

/// Opens the device for a program that runs on a GPU or on a CPU. There, drivers that run on the CPU will do.
/// @param options whose default modes are replaced. Without modes nothing is opened.
/// @return nullptr without modes, or an error as open_vulkan().
build::Result<std::shared_ptr<VulkanMachine>> open_chosen(VulkanOptions& options, bool gpu);

}  // namespace hiprt::bench
