#pragma once
/// Runs variants of the traversal on a device, a GPU or one thread of the CPU.

#include "input.h"
#include "ray_result.h"
#include "variant.h"

#include <benchmarks/engine/device.h>
#include <hiprt_device/instances/placed_object.h>

#include <memory>
#include <optional>
#include <vector>

namespace hiprt::bench {

/// Scenes that a variant can trace have no more features and levels.
struct Variant {
  VariantName name;
  Query query;
  FeatureMask features;
  unsigned levels;  ///< Of instances.
  bool custom;      ///< Whether it can intersect custom primitives.
  bool placed;      ///< Only for scenes that are one instance (PlacedObject).
  Resources resources;
};

/// Measurements of one variant.
struct Outcome {
  std::vector<double> milliseconds;  ///< One per timed repetition.
  std::vector<RayResult> results;    ///< One per ray, of the last repetition.
  std::uint64_t overflowed = 0;      ///< Rays of one repetition whose stack was too small.
};

class Engine {
 public:
  virtual ~Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  const std::vector<Variant>& variants() const { return variants_; }
  /// Name, memory, versions, and what is timed.
  virtual nlohmann::json describe() const = 0;
  /// Selects the tree that is traced from now on. It must outlive its use.
  build::Result<void> set_tree(const Tree& tree);
  /// Selects the rays that are traced from now on. They must outlive their use. rays() may hold fewer of them.
  virtual build::Result<void> set_rays(const RayBuffer& rays) = 0;
  virtual const std::vector<Ray>& rays() const = 0;
  /// @param variant index into variants(). Its layout is the tree's; its query is Query::kAny if the rays' is.
  virtual build::Result<Outcome> run(std::size_t variant, const Repetitions& repetitions) = 0;

 protected:
  explicit Engine(std::unique_ptr<Device> device) : device_(std::move(device)) {}

  std::unique_ptr<Device> device_;
  std::vector<Variant> variants_;
  LoadedScene scene_;
  std::optional<PlacedObject> placed_;  ///< The scene, if it is one instance.
  Array<Box> boxes_;                    ///< Custom primitives.
};

/// @param most_rays of a launch. The rays are taken in blocks of neighbours, spread evenly.
build::Result<std::unique_ptr<Engine>> make_cpu_engine(unsigned most_rays);
/// @return kNoDevice without a GPU, or if this program was built without GPU code.
build::Result<std::unique_ptr<Engine>> make_gpu_engine();

}  // namespace hiprt::bench
