#include "../common/sample_blocks.h"
#include "cpu_kernels.h"
#include "engine.h"

#include <benchmarks/common/machine.h>
#include <hiprt_build/format/view.h>
#include <hiprt_device/scene_view.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

namespace hiprt::bench {
namespace {

constexpr std::string_view kLayouts[] = {"float", "planes", "half", "quantized"};

struct NamedQuery {
  std::string_view name;
  Query query;
  std::string_view order;
};
constexpr NamedQuery kQueries[] = {
    {"closest", Query::kClosest, "sorted"}, {"any", Query::kAny, "stored"}, {"all", Query::kAll, "sorted"}};

/// One thread. What is timed: tracing all rays into an array of hits.
class CpuEngine final : public Engine {
 public:
  explicit CpuEngine(unsigned most_rays) : most_rays_(most_rays) {
    for (const std::string_view layout : kLayouts)
      for (const std::string_view tests : {"accurate", "fast"})
        for (const std::string_view features : {"masks", "custom", "moving32"})
          for (const NamedQuery& query : kQueries) add(layout, tests, features, query);
  }

  const std::vector<Variant>& variants() const override { return variants_; }
  const std::vector<Ray>& rays() const override { return rays_; }

  nlohmann::json describe() const override {
    return {{"kind", "cpu"},
            {"name", cpu_name()},
            {"instructions", cpu_isa()},
            {"threads", 1},
            {"timed",
             "one thread, steady clock: all rays into an array of hits with normal and error; of all hits 8 bytes"}};
  }

  build::Result<void> set_tree(const Tree& tree) override {
    scene_ = make_scene_view(tree.view);
    boxes_ = tree.boxes.data();
    return {};
  }

  build::Result<void> set_rays(const RayBuffer& rays) override {
    rays_.clear();
    for (const std::uint32_t i : sample_blocks(static_cast<std::uint32_t>(rays.rays.size()), most_rays_))
      rays_.push_back(rays.rays[i]);
    hits_.resize(rays_.size());
    answers_.resize(rays_.size());
    return {};
  }

  build::Result<Outcome> run(std::size_t variant, const Repetitions& repetitions) override {
    const Variant& chosen = variants_[variant];
    // A tracer with custom primitives is asked for even where the scene has none.
    const Box none{};
    const Box* boxes = !chosen.custom ? nullptr : boxes_ != nullptr ? boxes_ : &none;
    const CpuJob job{.scene = &scene_,
                     .query = chosen.query,
                     .fast = chosen.name.tests == "fast",
                     .levels = chosen.levels,
                     .boxes = boxes,
                     .rays = rays_.data(),
                     .hits = hits_.data(),
                     .answers = answers_.data(),
                     .count = rays_.size()};
    Outcome outcome;
    for (unsigned i = 0; i < repetitions.warm_up + repetitions.timed; ++i) {
      const auto start = std::chrono::steady_clock::now();
      run_on_cpu(job);
      const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
      if (i >= repetitions.warm_up) outcome.milliseconds.push_back(time.count());
    }
    if (chosen.query != Query::kAll) std::transform(hits_.begin(), hits_.end(), answers_.begin(), make_answer);
    outcome.answers = answers_;
    outcome.overflowed = static_cast<std::uint64_t>(std::count_if(answers_.begin(), answers_.end(), failed));
    return outcome;
  }

 private:
  void add(std::string_view layout, std::string_view tests, std::string_view features, const NamedQuery& query) {
    const bool custom = features == "custom", instances = features == "moving32";
    FeatureMask mask = kKnownFeatures;
    if (!custom) mask &= ~feature_bit(Feature::kCustom);
    if (!instances) mask &= ~(feature_bit(Feature::kInstances) | feature_bit(Feature::kMotion));
    variants_.push_back({{query.name, layout, tests, "private", "immediate", query.order, features, "1x1"},
                         query.query,
                         mask,
                         instances ? kCpuLevels : 0,
                         custom,
                         false,
                         Resources{}});
  }

  unsigned most_rays_;
  std::vector<Variant> variants_;
  SceneView scene_;
  const Box* boxes_ = nullptr;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<Answer> answers_;
};

}  // namespace

std::unique_ptr<Engine> make_cpu_engine(unsigned most_rays) { return std::make_unique<CpuEngine>(most_rays); }

}  // namespace hiprt::bench
