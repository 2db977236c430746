#include "engine.h"
#include "gpu_kernels.h"

#include <hiprt_build/format/only_instance.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/gpu/scene.h>
#include <hiprt_device/instances/placed_object.h>
#include <hiprt_device/traverse/stacks/stack.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

namespace hiprt::bench {
namespace {

using gpu::check;
using gpu::DeviceArray;

/// What .rays files hold.
struct PackedRay {
  float origin[3], tmin, direction[3], tmax;
};
static_assert(sizeof(PackedRay) == 32);

std::string driver_text() {
  std::ifstream file("/proc/driver/nvidia/version");
  std::string line;
  std::getline(file, line);
  return line;
}

/// The GPUs for which kHasRayInstruction is true.
bool has_ray_instruction(std::string_view architecture) {
  return architecture.starts_with("gfx103") || architecture.starts_with("gfx110");
}

/// Global memory for the stacks of one launch.
struct StackMemory {
  DeviceArray<StackEntry> entries;
  DeviceArray<std::uint32_t> locks;
};

class GpuEngine final : public Engine {
 public:
  static build::Result<std::unique_ptr<Engine>> make() {
    auto engine = std::make_unique<GpuEngine>();
    auto device = gpu::current_device();
    if (!device) return tl::unexpected(device.error());
    engine->device_ = std::move(*device);
    auto words = DeviceArray<std::uint32_t>::make(2, nullptr, engine->allocator_);
    if (!words) return tl::unexpected(words.error());
    engine->words_ = std::move(*words);
    engine->kernels_ = gpu_kernels();
    if (!has_ray_instruction(engine->device_.architecture))
      std::erase_if(engine->kernels_, [](const GpuKernel& kernel) { return kernel.ray_instruction; });
    for (const GpuKernel& kernel : engine->kernels_) {
      const auto resources = engine->measure_resources(kernel);
      if (!resources) return tl::unexpected(resources.error());
      const bool custom = (kernel.features & feature_bit(Feature::kCustom)) != 0;
      engine->variants_.push_back(
          {kernel.name, kernel.query, kernel.features, kernel.levels, custom, kernel.placed, *resources});
    }
    return engine;
  }

  const std::vector<Variant>& variants() const override { return variants_; }
  const std::vector<Ray>& rays() const override { return *rays_; }

  nlohmann::json describe() const override {
    int driver = 0, runtime = 0;
    static_cast<void>(hipDriverGetVersion(&driver));
    static_cast<void>(hipRuntimeGetVersion(&runtime));
    return {{"kind", "gpu"},
            {"name", device_.name},
            {"architecture", device_.architecture},
            {"compute_units", device_.compute_units},
            {"memory_bytes", device_.memory_bytes},
            {"driver_api_version", driver},
            {"runtime_version", runtime},
            {"driver", driver_text()},
            {"timed",
             "events around each launch, and the reset of its ray counter; launches queued without waiting; "
             "rays of 32 bytes, answers of 8 bytes: {t, id}, or the sum of all hits"}};
  }

  build::Result<void> set_tree(const Tree& tree) override {
    scene_ = {};
    auto scene = gpu::upload_scene(tree.view, nullptr, allocator_);
    if (!scene) return tl::unexpected(scene.error());
    scene_ = std::move(*scene);
    placed_ = only_instance(tree.view, scene_.view.base);
    auto boxes = DeviceArray<Box>::from(tree.boxes, nullptr, allocator_);
    if (!boxes) return tl::unexpected(boxes.error());
    boxes_ = std::move(*boxes);
    return check(hipStreamSynchronize(nullptr), "hipStreamSynchronize");
  }

  build::Result<void> set_rays(const RayBuffer& rays) override {
    std::vector<PackedRay> packed;
    for (const Ray& ray : rays.rays)
      packed.push_back({{ray.origin.x, ray.origin.y, ray.origin.z},
                        ray.tmin,
                        {ray.direction.x, ray.direction.y, ray.direction.z},
                        ray.tmax});
    device_rays_ = {};
    answers_ = {};
    auto device_rays = DeviceArray<PackedRay>::from(packed, nullptr, allocator_);
    if (!device_rays) return tl::unexpected(device_rays.error());
    auto answers = DeviceArray<Answer>::make(packed.size(), nullptr, allocator_);
    if (!answers) return tl::unexpected(answers.error());
    rays_ = &rays.rays;
    device_rays_ = std::move(*device_rays);
    answers_ = std::move(*answers);
    return check(hipStreamSynchronize(nullptr), "hipStreamSynchronize");
  }

  build::Result<Outcome> run(std::size_t variant, const Repetitions& repetitions) override {
    const GpuKernel& kernel = kernels_[variant];
    if (rays_->empty()) return Outcome{};
    GpuJob job = make_job();
    const unsigned grid = grid_of(kernel, variants_[variant].resources, job.count);
    StackMemory memory;
    if (auto made = make_stacks(kernel, grid, memory, job); !made) return tl::unexpected(made.error());
    if (auto filled = answers_.fill(std::byte{kPoison}, nullptr); !filled) return tl::unexpected(filled.error());
    if (auto filled = words_.fill(std::byte{0}, nullptr); !filled) return tl::unexpected(filled.error());
    auto times = time_launches(kernel, grid, job, repetitions);
    if (!times) return tl::unexpected(times.error());
    const auto words = words_.to_vector(nullptr);
    if (!words) return tl::unexpected(words.error());
    auto answers = answers_.to_vector(nullptr);
    if (!answers) return tl::unexpected(answers.error());
    return Outcome{std::move(*times), std::move(*answers), (*words)[1] / (repetitions.warm_up + repetitions.timed)};
  }

 private:
  build::Result<Resources> measure_resources(const GpuKernel& kernel) const {
    const void* function = reinterpret_cast<const void*>(kernel.kernel);
    hipFuncAttributes attributes{};
    if (auto got = check(hipFuncGetAttributes(&attributes, function), "hipFuncGetAttributes"); !got)
      return tl::unexpected(got.error());
    if (auto divided = gpu::divide_l1(function, kernel.block); !divided) return tl::unexpected(divided.error());
    const auto blocks = gpu::resident_blocks(function, kernel.block, 0);
    if (!blocks) return tl::unexpected(blocks.error());
    hipDeviceProp_t properties{};
    if (auto got = check(hipGetDeviceProperties(&properties, device_.index), "hipGetDeviceProperties"); !got)
      return tl::unexpected(got.error());
    Resources resources;
    resources.registers = static_cast<unsigned>(attributes.numRegs);
    resources.local_bytes = attributes.localSizeBytes;
    resources.shared_bytes = attributes.sharedSizeBytes;
    resources.resident_threads = *blocks * kernel.block;
    resources.occupancy = resources.resident_threads / static_cast<double>(properties.maxThreadsPerMultiProcessor);
    return resources;
  }

  GpuJob make_job() {
    GpuJob job{};
    job.scene = scene_.view;
    job.rays = device_rays_.data();
    job.answers = answers_.data();
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

  unsigned resident_blocks(const GpuKernel& kernel, const Resources& resources) const {
    return std::max(1u, resources.resident_threads / kernel.block) * device_.compute_units;
  }

  unsigned grid_of(const GpuKernel& kernel, const Resources& resources, std::uint32_t count) const {
    const unsigned blocks = (count - 1) / kernel.block + 1;
    return kernel.persistent ? std::min(blocks, resident_blocks(kernel, resources)) : blocks;
  }

  build::Result<void> make_stacks(const GpuKernel& kernel, unsigned grid, StackMemory& memory, GpuJob& job) {
    const std::uint32_t wanted = scene_.view.stack_bound + kMostPushed;
    const std::uint32_t entries = wanted > kernel.on_chip ? wanted - kernel.on_chip : 0;
    if (kernel.spill == SpillUse::kNone || entries == 0) return {};
    const unsigned waves_per_block = (kernel.block - 1) / device_.wave_size + 1;
    const std::size_t threads = std::size_t{grid} * kernel.block;
    const auto slots = static_cast<std::uint32_t>(
        std::min<std::size_t>(std::size_t{grid} * waves_per_block,
                              std::size_t{resident_blocks(kernel, most_resident(kernel))} * waves_per_block));
    const std::size_t bytes = kernel.spill == SpillUse::kGrid ? grid_spill_bytes(threads, entries)
                                                              : pool_spill_bytes(slots, entries, device_.wave_size);
    auto made = DeviceArray<StackEntry>::make(bytes / sizeof(StackEntry), nullptr, allocator_);
    if (!made) return tl::unexpected(made.error());
    memory.entries = std::move(*made);
    job.spill = memory.entries.data();
    job.spill_threads = static_cast<std::uint32_t>(threads);
    job.spill_entries = entries;
    if (kernel.spill != SpillUse::kPool) return {};
    auto locks = DeviceArray<std::uint32_t>::make(slots, nullptr, allocator_);
    if (!locks) return tl::unexpected(locks.error());
    memory.locks = std::move(*locks);
    job.pool = {memory.locks.data(), memory.entries.data(), slots, entries};
    return memory.locks.fill(std::byte{0}, nullptr);
  }

  const Resources& most_resident(const GpuKernel& kernel) const {
    return variants_[static_cast<std::size_t>(&kernel - kernels_.data())].resources;
  }

  static build::Result<void> launch(const GpuKernel& kernel, unsigned grid, GpuJob& job) {
    if (kernel.persistent) {
      if (auto reset = check(hipMemsetAsync(job.next, 0, sizeof(*job.next), nullptr), "hipMemsetAsync"); !reset)
        return reset;
    }
    void* arguments[] = {&job};
    return check(hipLaunchKernel(reinterpret_cast<const void*>(kernel.kernel), dim3(grid), dim3(kernel.block),
                                 arguments, 0, nullptr),
                 "hipLaunchKernel");
  }

  /// Nothing waits between the launches: what the host needs to start one is hidden behind the last one.
  static build::Result<std::vector<double>> time_launches(const GpuKernel& kernel, unsigned grid, GpuJob& job,
                                                          const Repetitions& repetitions) {
    for (unsigned i = 0; i < repetitions.warm_up; ++i)
      if (auto done = launch(kernel, grid, job); !done) return tl::unexpected(done.error());
    std::vector<gpu::StreamTimer> watches;
    for (unsigned i = 0; i < repetitions.timed; ++i) {
      auto watch = gpu::StreamTimer::make();
      if (!watch) return tl::unexpected(watch.error());
      watches.push_back(std::move(*watch));
    }
    for (gpu::StreamTimer& watch : watches) {
      auto done = watch.start(nullptr);
      if (done) done = launch(kernel, grid, job);
      if (done) done = watch.stop(nullptr);
      if (!done) return tl::unexpected(done.error());
    }
    std::vector<double> times;
    for (const gpu::StreamTimer& watch : watches) {
      const auto time = watch.milliseconds();
      if (!time) return tl::unexpected(time.error());
      times.push_back(static_cast<double>(*time));
    }
    return times;
  }

  gpu::DeviceAllocator allocator_;
  gpu::Device device_;
  std::vector<GpuKernel> kernels_;
  std::vector<Variant> variants_;
  DeviceArray<std::uint32_t> words_;  ///< GpuJob::next and GpuJob::overflowed.
  gpu::DeviceScene scene_;
  std::optional<PlacedObject> placed_;  ///< The scene, if it is one instance.
  DeviceArray<Box> boxes_;
  const std::vector<Ray>* rays_ = nullptr;
  DeviceArray<PackedRay> device_rays_;
  DeviceArray<Answer> answers_;
};

}  // namespace

build::Result<std::unique_ptr<Engine>> make_gpu_engine() { return GpuEngine::make(); }

}  // namespace hiprt::bench
