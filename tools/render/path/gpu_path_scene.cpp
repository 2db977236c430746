#include <tools/render/path/gpu_path_scene.h>

#include <tools/render/tracers/gpu_tracer.h>

#include <hiprt_build/gpu/gpu.h>

#include <type_traits>
#include <utility>

namespace hiprt::tools {
namespace {

template <class T> using PathDeviceArray = gpu::DeviceArray<T>;

}  // namespace

struct GpuPathScene::State {
  State(const SceneView& view, const PathSettings& settings) : scene{view, {}, settings} {}

  gpu::DeviceAllocator allocator;
  PathArrays<PathDeviceArray> arrays;
  PathScene scene;
  gpu::DeviceArray<PathScene> on_device;  ///< Copy of `scene` for filters. Empty: no material has an alpha cut-out.

  build::Result<void> upload(const PathData& data);
};

build::Result<void> GpuPathScene::State::upload(const PathData& data) {
  build::Result<void> done;
  PathData::for_each(data, arrays, [&](const auto& from, auto& to) {
    using Element = typename std::decay_t<decltype(from)>::value_type;
    if (!done) return;
    auto made = gpu::DeviceArray<Element>::from(from, nullptr, allocator);
    if (made)
      to = std::move(*made);
    else
      done = tl::unexpected(std::move(made.error()));
  });
  PathData::for_each(arrays, scene.arrays, [](const auto& from, auto& to) { to = {from.data(), from.size()}; });
  if (done && has_alpha_cutout(data)) {
    auto copy = gpu::DeviceArray<PathScene>::from(std::span(&scene, 1), nullptr, allocator);
    if (!copy) return tl::unexpected(std::move(copy.error()));
    on_device = std::move(*copy);
  }
  if (done) done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize", "copying materials");
  return done;
}

build::Result<GpuPathScene> GpuPathScene::make(GpuTracer& tracer, const PathData& data, const PathSettings& settings) {
  auto state = std::make_unique<State>(tracer.scene(), settings);
  if (auto done = state->upload(data); !done) return tl::unexpected(std::move(done.error()));
  return GpuPathScene(std::move(state));
}

GpuPathScene::GpuPathScene(std::unique_ptr<State> state) : state_(std::move(state)) {}
GpuPathScene::GpuPathScene(GpuPathScene&&) noexcept = default;
GpuPathScene& GpuPathScene::operator=(GpuPathScene&&) noexcept = default;
GpuPathScene::~GpuPathScene() = default;

const PathScene& GpuPathScene::scene() const { return state_->scene; }
const PathScene* GpuPathScene::cutout_scene() const { return state_->on_device.data(); }

}  // namespace hiprt::tools
