#pragma once
/// A library with one builder: it builds the BVHs of a hierarchy and traces rays through them.

#include "hierarchies.h"

#include <benchmarks/vulkan/machine.h>

#include <hiprt_build/build.h>
#include <hiprt_device/ray.h>
#include <hiprt_device/scene_view.h>
#include <tools/base/parallel.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hiprt::bench {

/// Build time from meshes in memory (of the device) to a BVH that can be traced.
struct BuildSeconds {
  double objects = 0;    ///< All BVHs over triangles.
  double instances = 0;  ///< All BVHs over instances.

  double all() const { return objects + instances; }
};

/// Size and quality of a BVH.
struct TreeFigures {
  /// hiprt: size of the file. Embree: memory of its device, with its copy of the meshes. Vulkan: the compacted
  /// acceleration structures.
  std::uint64_t bytes = 0;
  std::optional<double> sah_cost;  ///< build::measure_tree(), for flat hierarchies of hiprt.
  /// Vulkan's: bytes before compaction, bytes of scratch memory, and the time of compaction, which is no part of the
  /// build time.
  std::uint64_t built_bytes = 0, scratch_bytes = 0;
  std::optional<double> compaction_seconds;
};

class Competitor {
 public:
  Competitor(std::string tracer, std::string builder, const Hierarchy& hierarchy)
      : tracer_(std::move(tracer)), builder_(std::move(builder)), hierarchy_(hierarchy) {}
  Competitor(const Competitor&) = delete;
  Competitor& operator=(const Competitor&) = delete;
  virtual ~Competitor() = default;

  const std::string& tracer() const { return tracer_; }    ///< "hiprt", "embree" or "vulkan".
  const std::string& builder() const { return builder_; }  ///< One of tools::kBuilders, or the peer's mode.
  const Hierarchy& hierarchy() const { return hierarchy_; }
  /// "hiprt ploc flat"
  std::string name() const { return tracer_ + " " + builder_ + " " + hierarchy_.name; }

  /// Builds and replaces the last BVH.
  virtual build::Result<BuildSeconds> build() = 0;
  /// Called between the last build() and the first trace().
  virtual build::Result<void> prepare() = 0;
  /// Traces rays[i] into hits[i]. @param any_hit only whether there is a hit counts. @return seconds; a GPU measures
  /// its own.
  virtual build::Result<double> trace(bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) = 0;
  /// The id of the instance of each closest hit of the last trace(). Empty: not known.
  virtual std::span<const std::uint32_t> instances() const { return {}; }
  virtual TreeFigures figures() const = 0;
  /// Whether the CPU builds BVHs over triangles that a GPU traces. Then their build time is the CPU's.
  virtual bool cpu_builds_for_gpu() const { return false; }
  /// The BVH in the host's memory. All BVHs of a hierarchy must give identical hits. nullptr for peers.
  virtual const SceneView* view() const = 0;

 private:
  std::string tracer_, builder_;
  const Hierarchy& hierarchy_;
};

/// The device that builds and traces.
struct Machine {
  bool gpu = false;
  const tools::ThreadLimit& limit;        ///< Threads of the CPU.
  std::shared_ptr<VulkanMachine> vulkan;  ///< nullptr: see why_no_vulkan.
  std::string why_no_vulkan;
};

/// Our builder @p name (of tools::kBuilders) and the accurate tracer on the CPU or the GPU. For the GPU, the CPU builds
/// BVHs over instances, and those of Embree's builders.
std::unique_ptr<Competitor> make_hiprt(const std::string& name, const Hierarchy& hierarchy, const Machine& machine);

/// "default" (no flag, medium quality), "high" (high quality) and "robust" (RTC_SCENE_FLAG_ROBUST, medium quality).
std::vector<std::string> embree_modes();

/// Embree on the CPU, ray by ray (rtcIntersect1, rtcOccluded1).
/// @param mode of embree_modes().
std::unique_ptr<Competitor> make_embree(const std::string& mode, const Hierarchy& hierarchy,
                                        const tools::ThreadLimit& limit);

/// Vulkan on its device. @param mode of vulkan_modes().
std::unique_ptr<Competitor> make_vulkan(const std::string& mode, const Hierarchy& hierarchy,
                                        std::shared_ptr<VulkanMachine> machine);

/// Calls build(number, threads) for every object. Large objects are built one after the other by all threads, then
/// small objects at the same time by one thread each. @return the error of the object with the lowest number.
build::Result<void> for_each_object(const Hierarchy& hierarchy, const tools::ThreadLimit& limit,
                                    const std::function<build::Result<void>(std::size_t, unsigned)>& build);

}  // namespace hiprt::bench
