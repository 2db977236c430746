#include "engine.h"
#include "gpu_kernels.h"
#include "places.h"

#include <hiprt_build/gpu/gpu.h>
#include <tools/base/interrupt.h>

#include <algorithm>
#include <optional>

namespace hiprt::bench {

GpuKernels tradeoff_kernels_usual(std::size_t set);
GpuKernels tradeoff_kernels_fast_math(std::size_t set);
GpuKernels tradeoff_kernels_placed(std::size_t set);

GpuKernels gpu_kernels(Compiler compiler, std::size_t set, bool placed) {
  if (placed) return tradeoff_kernels_placed(set);
  return compiler == Compiler::kUsual ? tradeoff_kernels_usual(set) : tradeoff_kernels_fast_math(set);
}

namespace {

using gpu::check, gpu::DeviceArray;

class GpuEngine final : public Engine {
 public:
  static build::Result<std::unique_ptr<Engine>> make() {
    auto engine = std::make_unique<GpuEngine>();
    auto device = gpu::current_device();
    if (!device) return tl::unexpected(device.error());
    engine->device_ = std::move(*device);
    auto tally = DeviceArray<std::uint32_t>::make(4, nullptr, engine->allocator_);
    if (!tally) return tl::unexpected(tally.error());
    engine->tally_ = std::move(*tally);
    return engine;
  }

  nlohmann::json describe() const override {
    return {{"kind", "gpu"}, {"name", device_.name}, {"architecture", device_.architecture}};
  }

  const std::vector<Subject>& subjects() const override { return subjects_; }

  build::Result<void> set_model(const Model& model, const Trees& trees) override {
    placed_.reset();
    for (std::size_t i = 0; i < kLayouts; ++i)
      if (auto sent = upload(trees[i].buffer, scenes_[i]); !sent) return sent;
    return set_mesh(model);
  }

  build::Result<void> set_place(const Place& place) override {
    if (auto sent = upload(place.file, placed_.emplace()); !sent) return sent;
    return set_mesh(place.model);
  }
  bool traces_place(const Subject& subject) const override {
    return subject.settings == Compiler::kUsual && kPolicySets[subject.set].layout == NodeLayout::kPlanes;
  }

  build::Result<Tally> ask(const Subject& subject, Probe probe, std::uint64_t count) override {
    constexpr std::uint64_t kMost = 1u << 24;
    aim(subject, probe);
    Tally sum;
    for (std::uint64_t first = 0; first < count; first += kMost) {
      if (tools::interrupted()) return tl::unexpected(build::Error{build::ErrorCode::kCancelled, "interrupted"});
      const auto part = static_cast<std::uint32_t>(std::min(kMost, count - first));
      if (auto reset = tally_.fill(std::byte{0}, nullptr); !reset) return tl::unexpected(reset.error());
      GpuWork work{probe, first, part, tally_.data()};
      if (auto done = launch(kernels(subject).ask, work); !done) return tl::unexpected(done.error());
      const auto tally = tally_.to_vector(nullptr);
      if (!tally) return tl::unexpected(tally.error());
      sum.skipped += (*tally)[0];
      sum.faults += (*tally)[1];
      sum.lost += (*tally)[2];
      sum.folded += (*tally)[3];
    }
    return sum;
  }

  build::Result<double> trace(const Subject& subject, std::span<const Ray> rays, std::span<Hit> hits) override {
    if (rays_.data() == nullptr || host_rays_ != rays.data() || rays_.size() != rays.size()) {
      if (auto copied = copy(rays, rays_); !copied) return tl::unexpected(copied.error());
      host_rays_ = rays.data();
      auto made = DeviceArray<Hit>::make(rays.size(), nullptr, allocator_);
      if (!made) return tl::unexpected(made.error());
      hits_ = std::move(*made);
    }
    Probe probe;
    probe.question = Question::kTrace;
    aim(subject, probe);
    probe.target.rays = rays_.data();
    probe.target.hits = hits_.data();
    GpuWork work{probe, 0, static_cast<std::uint32_t>(rays.size()), nullptr};
    auto watch = gpu::StreamTimer::make();
    if (!watch) return tl::unexpected(watch.error());
    auto done = watch->start(nullptr);
    if (done) done = launch(kernels(subject).trace, work);
    if (done) done = watch->stop(nullptr);
    if (!done) return tl::unexpected(done.error());
    const auto time = watch->milliseconds();
    if (!time) return tl::unexpected(time.error());
    if (auto copied = hits_.download(hits, nullptr); !copied) return tl::unexpected(copied.error());
    return 1e-3 * double{*time};
  }

 private:
  GpuKernels kernels(const Subject& subject) const {
    return gpu_kernels(subject.settings, subject.set, placed_.has_value());
  }

  build::Result<void> upload(const build::Buffer& file, gpu::DeviceScene& to) {
    to = {};
    auto scene = gpu::upload_scene(file.bytes(), nullptr, allocator_);
    if (!scene) return tl::unexpected(scene.error());
    to = std::move(*scene);
    return {};
  }

  build::Result<void> set_mesh(const Model& model) {
    model_ = &model;
    rays_ = {};
    if (auto copied = copy(model.mesh.positions, positions_); !copied) return copied;
    return copy(model.mesh.triangles, triangles_);
  }

  template <class Range, class T> build::Result<void> copy(const Range& from, DeviceArray<T>& to) {
    to = {};
    auto made = DeviceArray<T>::from(from, nullptr, allocator_);
    if (!made) return tl::unexpected(made.error());
    to = std::move(*made);
    return {};
  }

  void aim(const Subject& subject, Probe& probe) const {
    Target& target = probe.target;
    target.scene = placed_ ? placed_->view : scenes_[layout_index(kPolicySets[subject.set].layout)].view;
    target.positions = positions_.data();
    target.triangles = triangles_.data();
    target.triangle_count = static_cast<std::uint32_t>(model_->mesh.triangles.size());
    target.centre = model_->centre;
    target.room = model_->room;
    target.extent = model_->extent;
  }

  static build::Result<void> launch(GpuKernel kernel, GpuWork& work) {
    void* arguments[] = {&work};
    return check(
        hipLaunchKernel(reinterpret_cast<const void*>(kernel), dim3((work.count + kTraceBlock - 1) / kTraceBlock),
                        dim3(kTraceBlock), arguments, 0, nullptr),
        "hipLaunchKernel");
  }

  gpu::DeviceAllocator allocator_;
  gpu::Device device_;
  std::vector<Subject> subjects_ = policy_subjects();
  DeviceArray<std::uint32_t> tally_;
  const Model* model_ = nullptr;
  std::array<gpu::DeviceScene, kLayouts> scenes_;
  std::optional<gpu::DeviceScene> placed_;
  DeviceArray<build::Position> positions_;
  DeviceArray<build::Triangle> triangles_;
  const Ray* host_rays_ = nullptr;
  DeviceArray<Ray> rays_;
  DeviceArray<Hit> hits_;
};

}  // namespace

build::Result<std::unique_ptr<Engine>> make_gpu_engine() { return GpuEngine::make(); }

}  // namespace hiprt::bench
