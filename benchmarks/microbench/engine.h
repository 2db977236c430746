#pragma once
/// What runs variants: a GPU or the CPU.

#include "answer.h"
#include "input.h"
#include "variant.h"

#include <nlohmann/json_fwd.hpp>

#include <memory>
#include <vector>

namespace hiprt::bench {

/// What a kernel takes of a multiprocessor; all zero on a CPU.
struct Resources {
  unsigned registers = 0;          ///< Of a thread.
  std::uint64_t local_bytes = 0;   ///< Of a thread: its stack, and what does not fit into registers.
  std::uint64_t shared_bytes = 0;  ///< Of a block.
  unsigned resident_threads = 0;   ///< Of a multiprocessor.
  double occupancy = 0;            ///< Resident threads relative to the most that a multiprocessor can have.
};

struct Variant {
  VariantName name;
  Query query;
  FeatureMask features;  ///< That a scene may have.
  unsigned levels;       ///< Of instances, that a scene may have.
  bool custom;           ///< Whether it can intersect custom primitives.
  bool placed;           ///< Only for scenes that are one instance (PlacedObject).
  Resources resources;
};

struct Repetitions {
  unsigned warm_up = 3;
  unsigned timed = 15;
};

/// What came of one variant.
struct Outcome {
  std::vector<double> milliseconds;  ///< One per timed repetition.
  std::vector<Answer> answers;       ///< One per ray, of all repetitions the last.
  std::uint64_t overflowed = 0;      ///< Rays of one repetition whose stack was too small.
};

class Engine {
 public:
  virtual ~Engine() = default;
  virtual const std::vector<Variant>& variants() const = 0;
  /// Name, memory, versions, and what is timed.
  virtual nlohmann::json describe() const = 0;
  /// The tree that is traced from now on; must outlive its use.
  virtual build::Result<void> set_tree(const Tree& tree) = 0;
  /// The rays that are traced from now on; must outlive their use. They may be fewer than given: rays().
  virtual build::Result<void> set_rays(const RayBuffer& rays) = 0;
  virtual const std::vector<Ray>& rays() const = 0;
  /// @param variant index into variants(); its layout is the tree's, and its query Query::kAny if the rays' is.
  virtual build::Result<Outcome> run(std::size_t variant, const Repetitions& repetitions) = 0;
};

/// @param most_rays of a launch; the rays are taken in blocks of neighbours, spread evenly.
std::unique_ptr<Engine> make_cpu_engine(unsigned most_rays);
/// @return kNoDevice without a GPU, or if this program was built without GPU code.
build::Result<std::unique_ptr<Engine>> make_gpu_engine();

}  // namespace hiprt::bench
