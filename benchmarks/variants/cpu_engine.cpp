#include "cpu_kernels.h"
#include "engine.h"

#include <benchmarks/common/sample_blocks.h>

#include <algorithm>
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

void run_range(const void* job, std::uint64_t begin, std::uint64_t end) {
  CpuJob range = *static_cast<const CpuJob*>(job);
  range.rays += begin;
  range.hits += begin;
  range.results += begin;
  range.count = end - begin;
  run_on_cpu(range);
}

/// One thread. The timed work is to trace all rays into an array of hits.
class CpuEngine final : public Engine {
 public:
  explicit CpuEngine(unsigned most_rays) : Engine(make_cpu_device(1)), most_rays_(most_rays) {
    for (const std::string_view layout : kLayouts)
      for (const std::string_view tests : {"accurate", "fast"})
        for (const std::string_view features : {"masks", "custom", "moving32"})
          for (const NamedQuery& query : kQueries) add(layout, tests, features, query);
  }

  const std::vector<Ray>& rays() const override { return rays_; }

  nlohmann::json describe() const override {
    nlohmann::json json = device_->describe();
    json["instructions"] = cpu_isa();
    json["timed"] =
        "one thread, steady clock: all rays into an array of hits with normal and error; of all hits 8 bytes";
    return json;
  }

  build::Result<void> set_rays(const RayBuffer& rays) override {
    rays_.clear();
    for (const std::uint32_t i : sample_blocks(static_cast<std::uint32_t>(rays.rays.size()), most_rays_))
      rays_.push_back(rays.rays[i]);
    hits_.resize(rays_.size());
    results_.resize(rays_.size());
    return {};
  }

  build::Result<Outcome> run(std::size_t variant, const Repetitions& repetitions) override {
    const Variant& chosen = variants_[variant];
    // A variant with custom primitives runs with them even where the scene has none.
    const Box none{};
    const Box* boxes = !chosen.custom ? nullptr : boxes_.size() != 0 ? boxes_.data() : &none;
    CpuJob job{.scene = &scene_.view,
               .query = chosen.query,
               .fast = chosen.name.tests == "fast",
               .levels = chosen.levels,
               .boxes = boxes,
               .rays = rays_.data(),
               .hits = hits_.data(),
               .results = results_.data(),
               .count = rays_.size()};
    auto times = device_->run({.kernel = {.cpu = run_range}, .job = &job, .count = job.count}, repetitions);
    if (!times) return tl::unexpected(times.error());
    if (chosen.query != Query::kAll) std::transform(hits_.begin(), hits_.end(), results_.begin(), make_result);
    const auto overflowed = std::count_if(results_.begin(), results_.end(), failed);
    return Outcome{std::move(*times), results_, static_cast<std::uint64_t>(overflowed)};
  }

 private:
  void add(std::string_view layout, std::string_view tests, std::string_view features, const NamedQuery& query) {
    const bool custom = features == "custom", instances = features == "moving32";
    FeatureMask mask = kKnownFeatures;
    if (!custom) mask &= ~feature_bit(Feature::kCustom);
    if (!instances) mask &= ~(feature_bit(Feature::kInstances) | feature_bit(Feature::kMotion));
    variants_.push_back({{query.name, layout, tests, "private", "immediate", query.order, features, "1x1", "id"},
                         query.query,
                         mask,
                         instances ? kCpuLevels : 0,
                         custom,
                         false,
                         Resources{}});
  }

  unsigned most_rays_;
  std::vector<Ray> rays_;
  std::vector<Hit> hits_;
  std::vector<RayResult> results_;
};

}  // namespace

build::Result<std::unique_ptr<Engine>> make_cpu_engine(unsigned most_rays) {
  return std::make_unique<CpuEngine>(most_rays);
}

}  // namespace hiprt::bench
