#pragma once
/// Somebody who builds trees over a form of a scene and traces rays through them.

#include "forms.h"

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

/// Of one build: from meshes in memory (a GPU's: on the device) to a tree that can be traced.
struct BuildSeconds {
  double objects = 0;    ///< Trees over triangles, all together.
  double instances = 0;  ///< Trees over instances.

  double all() const { return objects + instances; }
};

/// What is known of a tree beside its speed.
struct TreeFigures {
  std::uint64_t bytes = 0;         ///< hiprt: of the file; Embree: what its device holds, meshes included.
  std::optional<double> sah_cost;  ///< build::measure_tree(): flat forms only, hiprt's trees only.
};

class Competitor {
 public:
  Competitor(std::string tracer, std::string builder, const Form& form)
      : tracer_(std::move(tracer)), builder_(std::move(builder)), form_(form) {}
  Competitor(const Competitor&) = delete;
  Competitor& operator=(const Competitor&) = delete;
  virtual ~Competitor() = default;

  const std::string& tracer() const { return tracer_; }    ///< "hiprt" or "embree".
  const std::string& builder() const { return builder_; }  ///< Of tools::kBuilders, or Embree's mode.
  const Form& form() const { return form_; }
  /// "hiprt ploc flat"
  std::string name() const { return tracer_ + " " + builder_ + " " + form_.name; }

  /// Builds, again if need be; the new tree is kept.
  virtual build::Result<BuildSeconds> build() = 0;
  /// Between the last build() and the first trace().
  virtual build::Result<void> prepare() = 0;
  /// Answers rays[i] as hits[i]; any_hit: only whether there is a hit is asked. @return seconds, of a GPU its own.
  virtual build::Result<double> trace(bool any_hit, std::span<const Ray> rays, std::span<Hit> hits) = 0;
  virtual TreeFigures figures() const = 0;
  /// The tree in the host's memory, which has to answer to the last bit as all others of the form; nullptr: somebody
  /// else's.
  virtual const SceneView* view() const = 0;

 private:
  std::string tracer_, builder_;
  const Form& form_;
};

/// Who builds and who traces.
struct Machine {
  bool gpu = false;
  const tools::ThreadLimit& limit;  ///< Of the CPU.
};

/// Our builder @p name (of tools::kBuilders) on the CPU or the GPU, and the accurate tracer there. On a GPU trees over
/// instances are built by its CPU.
std::unique_ptr<Competitor> make_hiprt(const std::string& name, const Form& form, const Machine& machine);

/// "default" (no flag, medium quality), "high" (high quality) and "robust" (RTC_SCENE_FLAG_ROBUST, medium quality).
std::vector<std::string> embree_modes();

/// Embree on the CPU, asked ray by ray (rtcIntersect1, rtcOccluded1).
/// @param mode of embree_modes().
std::unique_ptr<Competitor> make_embree(const std::string& mode, const Form& form, const tools::ThreadLimit& limit);

/// Calls build(number, threads) for every object: large ones one after the other by all threads, then small ones many
/// at a time by one each. @return the first error by number.
build::Result<void> for_each_object(const Form& form, const tools::ThreadLimit& limit,
                                    const std::function<build::Result<void>(std::size_t, unsigned)>& build);

}  // namespace hiprt::bench
