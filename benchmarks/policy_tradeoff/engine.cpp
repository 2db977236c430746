#include "engine.h"

#include "instanced_spheres.h"

#include <hiprt_build/host/isa.h>
#include <tools/base/interrupt.h>

#include <algorithm>

namespace hiprt::bench {

Engine::Engine(std::unique_ptr<Device> device, bool is_gpu, VulkanScenes vulkan)
    : device_(std::move(device)), is_gpu_(is_gpu), subjects_(policy_subjects()), vulkan_(std::move(vulkan)) {}

build::Result<std::unique_ptr<Engine>> Engine::make(std::string_view name, unsigned threads, VulkanScenes vulkan) {
  const bool is_gpu = name == "gpu";
  if (!is_gpu && !format_detail::runs_isa("x86_64_v3"))
    return tl::unexpected(
        build::Error{build::ErrorCode::kInvalidInput, "the kernels need a processor with AVX2 and FMA"});
  auto device = is_gpu ? make_gpu_device() : make_cpu_device(threads);
  if (!device) return tl::unexpected(device.error());
  std::unique_ptr<Engine> engine(new Engine(std::move(*device), is_gpu, std::move(vulkan)));
  auto tally = Array<std::uint32_t>::make(*engine->device_, kTallyWords);
  if (!tally) return tl::unexpected(tally.error());
  engine->tally_ = std::move(*tally);
  if (!is_gpu)
    for (const Subject& subject : embree_subjects()) engine->subjects_.push_back(subject);
  for (const Subject& subject : vulkan_subjects(engine->vulkan_.modes())) engine->subjects_.push_back(subject);
  return engine;
}

build::Result<LoadedScene> Engine::load(const build::Buffer& file) {
  const auto view = open_buffer(file.bytes());
  if (!view) return tl::unexpected(build::Error{build::ErrorCode::kBackend, to_string(view.error())});
  return device_->load(*view);
}

build::Result<void> Engine::set_model(const Model& model, const Trees& trees) {
  instanced_.reset();
  for (std::size_t i = 0; i < kLayouts; ++i) {
    scenes_[i] = {};
    auto scene = load(trees[i].buffer);
    if (!scene) return tl::unexpected(scene.error());
    scenes_[i] = std::move(*scene);
  }
  if (!is_gpu_)
    if (auto set = embree_.set_model(model); !set) return set;
  if (auto set = vulkan_.set_model(model); !set) return set;
  return set_mesh(model);
}

build::Result<void> Engine::set_sphere(const InstancedSphere& sphere) {
  instanced_.reset();
  auto scene = load(sphere.file);
  if (!scene) return tl::unexpected(scene.error());
  instanced_ = std::move(*scene);
  if (!is_gpu_)
    if (auto set = embree_.set_sphere(sphere); !set) return set;
  return set_mesh(sphere.model);
}

bool Engine::can_trace_sphere(const Subject& subject) const {
  if (!subject.vulkan.empty()) return false;
  if (!subject.ours) return embree_.sphere(subject.robust) != nullptr;
  return subject.settings == Compiler::kUsual && kPolicySets[subject.set].layout == NodeLayout::kPlanes;
}

build::Result<void> Engine::set_mesh(const Model& model) {
  model_ = &model;
  host_rays_ = nullptr;
  positions_ = {};
  triangles_ = {};
  auto positions = Array<build::Position>::copy(*device_, model.mesh.positions);
  if (!positions) return tl::unexpected(positions.error());
  positions_ = std::move(*positions);
  auto triangles = Array<build::Triangle>::copy(*device_, model.mesh.triangles);
  if (!triangles) return tl::unexpected(triangles.error());
  triangles_ = std::move(*triangles);
  return {};
}

build::Result<void> Engine::set_rays(std::span<const Ray> rays) {
  if (host_rays_ == rays.data() && rays_.size() == rays.size()) return {};
  rays_ = {};
  hits_ = {};
  auto copy = Array<Ray>::copy(*device_, rays);
  if (!copy) return tl::unexpected(copy.error());
  rays_ = std::move(*copy);
  auto hits = Array<Hit>::make(*device_, rays.size());
  if (!hits) return tl::unexpected(hits.error());
  hits_ = std::move(*hits);
  host_rays_ = rays.data();
  return {};
}

Kernels Engine::kernels(const Subject& subject) const {
  if (!subject.ours) return embree_kernels();
#if HIPRT_BENCH_GPU
  if (is_gpu_) return gpu_kernels(subject.settings, subject.set, instanced_.has_value());
#endif
  return cpu_kernels(subject.settings);
}

Work Engine::make_work(const Subject& subject, const Probe& probe) const {
  Work work;
  work.probe = probe;
  Target& target = work.probe.target;
  target = host_target();
  target.scene = instanced_ ? instanced_->view : scenes_[layout_index(kPolicySets[subject.set].layout)].view;
  target.positions = positions_.data();
  target.triangles = triangles_.data();
  target.rays = rays_.data();
  target.hits = hits_.data();
  work.set = static_cast<std::uint32_t>(subject.set);
  work.instanced = instanced_.has_value();
  work.tally = tally_.data();
  if (!subject.ours) work.embree = instanced_ ? embree_.sphere(subject.robust) : embree_.model(subject.robust);
  return work;
}

Target Engine::host_target() const {
  Target target;
  target.positions = model_->mesh.positions.data();
  target.triangles = model_->mesh.triangles.data();
  target.triangle_count = static_cast<std::uint32_t>(model_->mesh.triangles.size());
  target.centre = model_->centre;
  target.inner_radius = model_->room;
  target.extent = model_->extent;
  return target;
}

build::Result<Tally> Engine::check_part(const Subject& subject, Work& work) {
  if (!subject.vulkan.empty()) {
    Probe probe = work.probe;
    probe.target = host_target();
    return vulkan_.check(subject.vulkan, probe, work.first, work.count);
  }
  if (auto reset = device_->fill(tally_.memory(), std::byte{0}); !reset) return tl::unexpected(reset.error());
  const Launch launch{.kernel = kernels(subject).check, .job = &work, .count = work.count};
  if (auto done = device_->run(launch, {.warm_up = 0, .timed = 1}); !done) return tl::unexpected(done.error());
  const auto tally = tally_.to_vector(*device_);
  if (!tally) return tl::unexpected(tally.error());
  return Tally{(*tally)[0], (*tally)[1], (*tally)[2], (*tally)[3]};
}

build::Result<Tally> Engine::check(const Subject& subject, Probe probe, std::uint64_t count) {
  // Vulkan's rays are in the host's memory too.
  const std::uint64_t most = subject.vulkan.empty() ? 1u << 24 : 1u << 22;
  Work work = make_work(subject, probe);
  Tally sum;
  for (work.first = 0; work.first < count; work.first += most) {
    if (tools::interrupted()) return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "interrupted"});
    work.count = static_cast<std::uint32_t>(std::min(most, count - work.first));
    auto tally = check_part(subject, work);
    if (!tally) return tally;
    sum.skipped += tally->skipped;
    sum.faults += tally->faults;
    sum.lost += tally->lost;
    sum.folded += tally->folded;
  }
  return sum;
}

build::Result<double> Engine::trace(const Subject& subject, std::span<const Ray> rays, std::span<Hit> hits) {
  if (!subject.vulkan.empty()) return vulkan_.trace(subject.vulkan, rays, hits);
  if (auto set = set_rays(rays); !set) return tl::unexpected(set.error());
  Probe probe;
  probe.kind = CheckKind::kTrace;
  Work work = make_work(subject, probe);
  work.count = static_cast<std::uint32_t>(rays.size());
  const Launch launch{.kernel = kernels(subject).trace, .job = &work, .count = work.count};
  // The first launch after one of Vulkan waits for the GPU to change to this context.
  const auto times = device_->run(launch, {.warm_up = vulkan_.modes().empty() ? 0u : 1u, .timed = 1});
  if (!times) return tl::unexpected(times.error());
  if (auto read = device_->read(hits_.memory(), std::as_writable_bytes(hits)); !read)
    return tl::unexpected(read.error());
  return 1e-3 * times->front();
}

}  // namespace hiprt::bench
