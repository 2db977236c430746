#include "engine.h"
#include "gpu_kernels.h"

#include <hiprt_device/traverse/stacks/stack.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace hiprt::bench {
namespace {

/// A record of .rays files.
struct PackedRay {
  float origin[3], tmin, direction[3], tmax;
};
static_assert(sizeof(PackedRay) == 32);

/// Global memory for the stacks of one launch.
struct StackMemory {
  Array<StackEntry> entries;
  Array<std::uint32_t> locks;
};

class GpuEngine final : public Engine {
 public:
  static build::Result<std::unique_ptr<Engine>> make() {
    auto device = make_gpu_device();
    if (!device) return tl::unexpected(device.error());
    std::unique_ptr<GpuEngine> engine(new GpuEngine(std::move(*device)));
    auto words = Array<std::uint32_t>::make(*engine->device_, 2);
    if (!words) return tl::unexpected(words.error());
    engine->words_ = std::move(*words);
    for (const GpuKernel& kernel : gpu_kernels())
      if (auto added = engine->add(kernel); !added) return tl::unexpected(added.error());
    return engine;
  }

  const std::vector<Ray>& rays() const override { return *rays_; }

  nlohmann::json describe() const override {
    nlohmann::json json = device_->describe();
    json["timed"] =
        "events around each launch, and the reset of its ray counter; launches queued without waiting; "
        "answers id: rays of 32 bytes, results of 8 bytes: {t, id}, or the sum of all hits; answers hit: Ray and Hit";
    return json;
  }

  build::Result<void> set_rays(const RayBuffer& rays) override {
    std::vector<PackedRay> packed;
    for (const Ray& ray : rays.rays)
      packed.push_back({{ray.origin.x, ray.origin.y, ray.origin.z},
                        ray.tmin,
                        {ray.direction.x, ray.direction.y, ray.direction.z},
                        ray.tmax});
    device_rays_ = {};
    results_ = {};
    whole_rays_ = {};
    hits_ = {};
    auto device_rays = Array<PackedRay>::copy(*device_, packed);
    if (!device_rays) return tl::unexpected(device_rays.error());
    auto results = Array<RayResult>::make(*device_, packed.size());
    if (!results) return tl::unexpected(results.error());
    rays_ = &rays.rays;
    device_rays_ = std::move(*device_rays);
    results_ = std::move(*results);
    if (std::ranges::none_of(kernels_, [](const GpuKernel& k) { return k.answer == Answer::kHit; })) return {};
    auto whole_rays = Array<Ray>::copy(*device_, timed_rays(rays.rays));
    if (!whole_rays) return tl::unexpected(whole_rays.error());
    auto hits = Array<Hit>::make(*device_, rays.rays.size());
    if (!hits) return tl::unexpected(hits.error());
    whole_rays_ = std::move(*whole_rays);
    hits_ = std::move(*hits);
    return {};
  }

  build::Result<Outcome> run(std::size_t variant, const Repetitions& repetitions) override {
    const GpuKernel& kernel = kernels_[variant];
    if (rays_->empty()) return Outcome{};
    GpuJob job = make_job(kernel.answer);
    Launch launch{.kernel = to_kernel(kernel), .job = &job, .count = job.count, .grid = grid_of(variant, job.count)};
    if (kernel.persistent) launch.counter = job.next;
    StackMemory memory;
    if (auto made = make_stacks(variant, launch.grid, memory, job); !made) return tl::unexpected(made.error());
    auto filled = device_->fill(kernel.answer == Answer::kHit ? hits_.memory() : results_.memory(), std::byte{kPoison});
    if (filled) filled = device_->fill(words_.memory(), std::byte{0});
    if (!filled) return tl::unexpected(filled.error());
    auto times = device_->run(launch, repetitions);
    if (!times) return tl::unexpected(times.error());
    const auto words = words_.to_vector(*device_);
    if (!words) return tl::unexpected(words.error());
    auto results = read_results(kernel.answer);
    if (!results) return tl::unexpected(results.error());
    return Outcome{std::move(*times), std::move(*results), (*words)[1] / (repetitions.warm_up + repetitions.timed)};
  }

 private:
  explicit GpuEngine(std::unique_ptr<Device> device) : Engine(std::move(device)) {}

  static Kernel to_kernel(const GpuKernel& kernel) {
    return {.gpu = reinterpret_cast<const void*>(kernel.kernel), .block = kernel.block};
  }

  build::Result<void> add(const GpuKernel& kernel) {
    if (kernel.ray_instruction && !device_->has_ray_instruction()) return {};
    const auto resources = device_->resources(to_kernel(kernel));
    if (!resources) return tl::unexpected(resources.error());
    const bool custom = (kernel.features & feature_bit(Feature::kCustom)) != 0;
    kernels_.push_back(kernel);
    variants_.push_back({kernel.name, kernel.query, kernel.features, kernel.levels, custom, kernel.placed, *resources});
    return {};
  }

  /// Rays of Answer::kHit, with the times that the kernels of Answer::kId compute.
  static std::vector<Ray> timed_rays(std::vector<Ray> rays) {
    for (std::uint32_t i = 0; i < rays.size(); ++i) {
      rays[i].mask = 0xffffffffu;
      rays[i].time = ray_time(i);
    }
    return rays;
  }

  build::Result<std::vector<RayResult>> read_results(Answer answer) {
    if (answer == Answer::kId) return results_.to_vector(*device_);
    const auto hits = hits_.to_vector(*device_);
    if (!hits) return tl::unexpected(hits.error());
    std::vector<RayResult> results(hits->size());
    std::ranges::transform(*hits, results.begin(), [](const Hit& hit) { return make_result(hit); });
    return results;
  }

  GpuJob make_job(Answer answer) {
    GpuJob job{};
    job.scene = scene_.view;
    const bool whole = answer == Answer::kHit;
    job.rays = whole ? static_cast<const void*>(whole_rays_.data()) : device_rays_.data();
    job.results = whole ? static_cast<void*>(hits_.data()) : results_.data();
    job.count = static_cast<std::uint32_t>(rays_->size());
    job.next = words_.data();
    job.overflowed = words_.data() + 1;
    job.boxes = boxes_.data();
    if (placed_) {
      job.object = placed_->object;
      job.instance = placed_->instance;
    }
    return job;
  }

  unsigned resident_blocks(std::size_t variant) const {
    return std::max(1u, variants_[variant].resources.resident_threads / kernels_[variant].block) *
           device_->compute_units();
  }

  unsigned grid_of(std::size_t variant, std::uint32_t count) const {
    const unsigned blocks = (count - 1) / kernels_[variant].block + 1;
    return kernels_[variant].persistent ? std::min(blocks, resident_blocks(variant)) : blocks;
  }

  build::Result<void> make_stacks(std::size_t variant, unsigned grid, StackMemory& memory, GpuJob& job) {
    const GpuKernel& kernel = kernels_[variant];
    const std::uint32_t wanted = scene_.view.stack_bound + kMostPushed;
    const std::uint32_t entries = wanted > kernel.on_chip ? wanted - kernel.on_chip : 0;
    if (kernel.spill == SpillUse::kNone || entries == 0) return {};
    const unsigned waves_per_block = (kernel.block - 1) / device_->wave_size() + 1;
    const std::size_t threads = std::size_t{grid} * kernel.block;
    const auto slots = static_cast<std::uint32_t>(std::min<std::size_t>(
        std::size_t{grid} * waves_per_block, std::size_t{resident_blocks(variant)} * waves_per_block));
    const std::size_t bytes = kernel.spill == SpillUse::kGrid ? grid_spill_bytes(threads, entries)
                                                              : pool_spill_bytes(slots, entries, device_->wave_size());
    auto made = Array<StackEntry>::make(*device_, bytes / sizeof(StackEntry));
    if (!made) return tl::unexpected(made.error());
    memory.entries = std::move(*made);
    job.spill = memory.entries.data();
    job.spill_threads = static_cast<std::uint32_t>(threads);
    job.spill_entries = entries;
    if (kernel.spill != SpillUse::kPool) return {};
    auto locks = Array<std::uint32_t>::make(*device_, slots);
    if (!locks) return tl::unexpected(locks.error());
    memory.locks = std::move(*locks);
    job.pool = {memory.locks.data(), memory.entries.data(), slots, entries};
    return device_->fill(memory.locks.memory(), std::byte{0});
  }

  std::vector<GpuKernel> kernels_;  ///< Of variants_.
  Array<std::uint32_t> words_;      ///< GpuJob::next and GpuJob::overflowed.
  const std::vector<Ray>* rays_ = nullptr;
  Array<PackedRay> device_rays_;
  Array<RayResult> results_;
  Array<Ray> whole_rays_;  ///< Of Answer::kHit, as hits_.
  Array<Hit> hits_;
};

}  // namespace

build::Result<std::unique_ptr<Engine>> make_gpu_engine() { return GpuEngine::make(); }

}  // namespace hiprt::bench
