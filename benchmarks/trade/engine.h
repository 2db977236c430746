#pragma once
/// Who is asked: policy sets on the CPU's threads, beside Embree, or on a GPU.

#include "kernels.h"
#include "model.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace hiprt::bench {

/// A policy set as it was compiled, or another library's tracer.
struct Subject {
  std::string name;
  std::string triangle, boxes, layout, compiler;  ///< "" of other libraries.
  std::size_t set = 0;                            ///< In kPolicySets.
  Compiler settings = Compiler::kUsual;
  bool ours = true;  ///< Has error bounds, and boxes that can be widened.
};

/// Our subjects, in the order in which they are shown.
std::vector<Subject> policy_subjects();

struct Place;

class Engine {
 public:
  virtual ~Engine() = default;
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// The device, for JSON.
  virtual nlohmann::json describe() const = 0;
  virtual const std::vector<Subject>& subjects() const = 0;
  /// What the following calls trace. The model has to live as long.
  virtual build::Result<void> set_model(const Model& model, const Trees& trees) = 0;
  /// What the following calls trace, until the next set_model(): a mesh seen through instances.
  virtual build::Result<void> set_place(const Place& place) = 0;
  /// Behind set_place(): whether this subject can trace the place.
  virtual bool traces_place(const Subject&) const = 0;
  /// Asks rays [0, count) of a probe, whose target is filled in here. Question::kTrace: see trace().
  virtual build::Result<Tally> ask(const Subject& subject, Probe probe, std::uint64_t count) = 0;
  /// Traces rays[i] into hits[i] (closest hit). @return seconds, without copies.
  virtual build::Result<double> trace(const Subject& subject, std::span<const Ray> rays, std::span<Hit> hits) = 0;
};

/// @return or kInvalidInput where the processor is too old.
build::Result<std::unique_ptr<Engine>> make_cpu_engine(unsigned threads);
/// @return or kBackend where there is no GPU, or no code for it.
build::Result<std::unique_ptr<Engine>> make_gpu_engine();

}  // namespace hiprt::bench
