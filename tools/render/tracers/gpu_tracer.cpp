#include <tools/render/tracers/gpu_tracer.h>

#include <tools/base/gpu_device.h>
#include <tools/base/interrupt.h>
#include <tools/render/tracers/gpu_kernels.h>
#include <tools/render/tracers/gpu_policies.h>

#include <hiprt_build/format/only_instance.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/instances/placed_object.h>
#include <hiprt_device/traverse/stacks/rolling.h>

#include <algorithm>
#include <optional>

namespace hiprt::tools {
namespace {

/// Bytes for the stacks of all threads; of deeper trees fewer threads run.
constexpr std::size_t kSpillLimit = std::size_t{1} << 30;

/// What a launch of one kernel needs beside rays and hits.
struct Launch {
  GpuTraceKernel kernel;
  unsigned block, blocks;
  std::uint32_t spill_entries;
  bool paths;  ///< Whether to store instance paths.
};

}  // namespace

struct GpuTracer::State {
  explicit State(gpu::StreamTimer stopwatch) : watch(std::move(stopwatch)) {}

  GpuTracerOptions options;
  gpu::DeviceAllocator allocator;
  gpu::Device device;
  std::string device_name;
  gpu::DeviceScene scene;
  std::optional<PlacedObject> placed;  ///< The scene, if it is one instance of triangles.
  gpu::DeviceArray<Ray> rays;
  gpu::DeviceArray<Hit> hits;
  gpu::DeviceArray<std::uint32_t> paths;
  gpu::DeviceArray<GpuCounts> counts;
  gpu::DeviceArray<StackEntry> spill;
  gpu::StreamTimer watch;

  build::Result<Launch> plan(Query query, const TracePolicies& policies, bool with_paths,
                             bool alpha_cutout = false) const;
  build::Result<void> reserve(const Launch& launch, std::size_t count);
  build::Result<double> trace_part(const Launch& launch, std::span<const Ray> from, std::span<Hit> to,
                                   std::span<std::uint32_t> to_paths, const PathScene* cutout_scene);
  build::Result<void> start(const Launch& launch, const DeviceRays& rays, const PathScene* cutout_scene);
  build::Result<double> run(const Launch& launch, std::uint32_t count, const PathScene* cutout_scene,
                            GpuCounts& counted);
};

build::Result<Launch> GpuTracer::State::plan(Query query, const TracePolicies& policies, bool with_paths,
                                             bool alpha_cutout) const {
  const std::uint32_t bound = scene.view.stack_bound;
  GpuTraceKernel kernel = nullptr;
  const std::size_t chosen = choose_gpu_policy(device.architecture, scene.view, [&](std::size_t policy) {
    kernel = alpha_cutout                            ? find_alpha_cutout_kernel(policy, scene.view, query)
             : placed && policies == TracePolicies{} ? find_placed_kernel(policy, placed->object, query)
                                                     : find_trace_kernel(policy, scene.view, query, policies);
    return kernel != nullptr;
  });
  if (kernel == nullptr)
    return gpu::fail(gpu::ErrorCode::kNoDevice, device_name, ": no kernel for trees of stack bound ", bound, " with ",
                     scene.view.levels, " levels of instances");
  const GpuPolicy& policy = kGpuPolicies[chosen];
  if (auto divided = gpu::divide_l1(reinterpret_cast<const void*>(kernel), policy.block); !divided)
    return tl::unexpected(std::move(divided.error()));
  const auto blocks = gpu::persistent_grid(kernel, policy.block);
  if (!blocks) return tl::unexpected(blocks.error());
  Launch launch{kernel, policy.block, *blocks, 0, with_paths};
  if (policy.stack == GpuStack::kPrivate) return launch;
  launch.spill_entries = RollingStack<kGpuRing>::spill_entries(bound);
  const std::size_t block_bytes = std::max<std::size_t>(grid_spill_bytes(policy.block, launch.spill_entries), 1);
  launch.blocks = static_cast<unsigned>(std::clamp<std::size_t>(kSpillLimit / block_bytes, 1, launch.blocks));
  return launch;
}

/// Grows the arrays where they are too small. They are kept for the next call.
build::Result<void> GpuTracer::State::reserve(const Launch& launch, std::size_t count) {
  const auto grow = [&](auto& array, std::size_t wanted) -> build::Result<void> {
    if (array.size() >= wanted) return {};
    array.release();
    auto made = std::decay_t<decltype(array)>::make(wanted, nullptr, allocator);
    if (!made) return tl::unexpected(std::move(made.error()));
    array = std::move(*made);
    return {};
  };
  if (auto done = grow(rays, count); !done) return done;
  if (auto done = grow(hits, count); !done) return done;
  if (auto done = grow(paths, launch.paths ? count * scene.view.levels : 0); !done) return done;
  if (auto done = grow(counts, 1); !done) return done;
  return grow(spill, std::size_t{launch.blocks} * launch.block * launch.spill_entries);
}

build::Result<void> GpuTracer::State::start(const Launch& launch, const DeviceRays& work,
                                            const PathScene* cutout_scene) {
  GpuTraceJob job{};
  job.scene = scene.view;
  job.rays = work.rays;
  job.hits = work.hits;
  job.count = work.count;
  job.spill_entries = launch.spill_entries;
  job.spill = spill.data();
  job.counts = counts.data();
  job.paths = work.paths;
  job.cutout_scene = cutout_scene;
  if (placed) {
    job.object = placed->object;
    job.instance = placed->instance;
  }
  const unsigned blocks = std::min(launch.blocks, (work.count - 1) / launch.block + 1);
  return gpu::launch(launch.kernel, gpu::Grid{.x = blocks}, nullptr, {.block = launch.block, .name = "trace_rays"},
                     job);
}

/// The kernel alone. @return seconds. @param counted filled once the stream has been waited for, as it has here.
build::Result<double> GpuTracer::State::run(const Launch& launch, std::uint32_t count, const PathScene* cutout_scene,
                                            GpuCounts& counted) {
  auto done = counts.fill(std::byte{0}, nullptr);
  if (done) done = watch.start(nullptr);
  if (done)
    done = start(launch, {rays.data(), hits.data(), launch.paths ? paths.data() : nullptr, count}, cutout_scene);
  if (done) done = watch.stop(nullptr);
  if (done) done = counts.download(std::span(&counted, 1), nullptr);
  if (done) done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize", "trace_rays, ", count, " rays");
  if (!done) return tl::unexpected(std::move(done.error()));
  const auto milliseconds = watch.milliseconds();
  if (!milliseconds) return tl::unexpected(milliseconds.error());
  return static_cast<double>(*milliseconds) * 1e-3;
}

build::Result<double> GpuTracer::State::trace_part(const Launch& launch, std::span<const Ray> from, std::span<Hit> to,
                                                   std::span<std::uint32_t> to_paths, const PathScene* cutout_scene) {
  GpuCounts counted{};
  auto done = rays.upload(from, nullptr);
  if (!done) return tl::unexpected(std::move(done.error()));
  auto seconds = run(launch, static_cast<std::uint32_t>(from.size()), cutout_scene, counted);
  if (!seconds) return seconds;
  if (counted.overflowed_rays != 0)
    return gpu::fail(gpu::ErrorCode::kGpu, counted.overflowed_rays, " of ", from.size(),
                     " rays needed more stack entries than the scene says, ", scene.view.stack_bound);
  done = hits.download(to, nullptr);
  if (done && launch.paths) done = paths.download(to_paths, nullptr);
  if (done) done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize", to.size(), " hits");
  if (!done) return tl::unexpected(std::move(done.error()));
  return seconds;
}

std::vector<std::string> GpuTracer::devices() {
  std::vector<std::string> addresses;
  const auto all = gpu::devices();
  for (int i = 0; all && i < static_cast<int>(all->size()); ++i) {
    hipDeviceProp_t properties{};
    if (!gpu::check(hipGetDeviceProperties(&properties, i), "hipGetDeviceProperties", "device ", i)) return {};
    addresses.push_back(std::to_string(properties.pciDomainID) + ":" + std::to_string(properties.pciBusID) + ":" +
                        std::to_string(properties.pciDeviceID));
  }
  return addresses;
}

build::Result<GpuTracer> GpuTracer::make(const BufferView& view, const GpuTracerOptions& options) {
  if (options.device)
    if (auto set = gpu::check(hipSetDevice(*options.device), "hipSetDevice", "device ", *options.device); !set)
      return tl::unexpected(std::move(set.error()));
  auto device = usable_device();
  if (!device) return tl::unexpected(std::move(device.error()));
  const SceneView on_host = make_scene_view(view);
  const std::size_t policy = choose_gpu_policy(device->architecture, on_host, [&](std::size_t i) {
    return find_trace_kernel(i, on_host, Query::kClosest, options.policies) != nullptr;
  });
  if (policy == kGpuPolicies.size())
    return gpu::fail(
        gpu::ErrorCode::kNoDevice, on_host.levels,
        " levels of instances, things that move, spheres or curves, for which there are the watertight and "
        "conservative tests only: the CPU has the others");
  auto watch = gpu::StreamTimer::make();
  if (!watch) return tl::unexpected(std::move(watch.error()));
  auto state = std::make_unique<State>(std::move(*watch));
  auto scene = gpu::upload_scene(view, nullptr, state->allocator);
  if (!scene) return tl::unexpected(std::move(scene.error()));
  state->options = options;
  state->device_name = device->name + ", " + device->architecture;
  state->device = std::move(*device);
  state->scene = std::move(*scene);
  state->placed = only_instance(view, state->scene.view.base);
  // Shapes have no kernels of their own for it.
  if (state->placed && (state->placed->object.features & feature_bit(Feature::kCustom)) != 0) state->placed.reset();
  return GpuTracer(std::move(state));
}

GpuTracer::GpuTracer(std::unique_ptr<State> state) : state_(std::move(state)) {}
GpuTracer::GpuTracer(GpuTracer&&) noexcept = default;
GpuTracer& GpuTracer::operator=(GpuTracer&&) noexcept = default;
GpuTracer::~GpuTracer() = default;

const std::string& GpuTracer::device_name() const { return state_->device_name; }

build::Result<void> GpuTracer::make_current() const {
  return gpu::check(hipSetDevice(state_->device.index), "hipSetDevice", "device ", state_->device.index);
}

const SceneView& GpuTracer::scene() const { return state_->scene.view; }

build::Result<void> GpuTracer::trace_on_device(Query query, const DeviceRays& rays, const PathScene* cutout_scene) {
  if (rays.count == 0) return {};
  const auto launch = state_->plan(query, {}, rays.paths != nullptr, cutout_scene != nullptr);
  if (!launch) return tl::unexpected(launch.error());
  auto done = state_->reserve(*launch, 0);
  if (done) done = state_->counts.fill(std::byte{0}, nullptr);
  if (done) done = state_->start(*launch, rays, cutout_scene);
  return done;
}

build::Result<double> GpuTracer::trace(Query query, const TracePolicies& policies, std::span<const Ray> rays,
                                       std::span<Hit> hits, const std::function<void(double)>& progress,
                                       std::span<std::uint32_t> paths, const PathScene* cutout_scene) {
  if (rays.empty()) return 0.0;
  const auto launch = state_->plan(query, policies, !paths.empty(), cutout_scene != nullptr);
  if (!launch) return tl::unexpected(launch.error());
  const std::size_t most = state_->options.rays_at_once;
  if (auto reserved = state_->reserve(*launch, std::min(most, rays.size())); !reserved)
    return tl::unexpected(std::move(reserved.error()));
  double seconds = 0;
  for (std::size_t begin = 0; begin < rays.size(); begin += most) {
    if (interrupted()) return gpu::fail(gpu::ErrorCode::kCancelled, "cancelled");
    const std::size_t count = std::min(most, rays.size() - begin);
    const std::size_t levels = paths.empty() ? 0 : state_->scene.view.levels;
    auto part = state_->trace_part(*launch, rays.subspan(begin, count), hits.subspan(begin, count),
                                   paths.subspan(begin * levels, count * levels), cutout_scene);
    if (!part) return part;
    seconds += *part;
    if (progress) progress(static_cast<double>(begin + count) / static_cast<double>(rays.size()));
  }
  return seconds;
}

}  // namespace hiprt::tools
