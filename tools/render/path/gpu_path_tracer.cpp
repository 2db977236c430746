#include <tools/render/path/gpu_path_tracer.h>

#include <tools/render/path/gpu_path_kernels.h>
#include <tools/render/path/gpu_path_scene.h>
#include <tools/render/path/path_wave.h>
#include <tools/render/tracers/gpu_tracer.h>

#include <hiprt_build/gpu/gpu.h>

#include <utility>

namespace hiprt::tools {
namespace {

/// Paths of a batch: they fill a GPU many times over, and take 600 MB, and 8 MB for each level of instances.
constexpr std::uint32_t kCapacity = 1u << 21;

/// A wave's steps on a stream of the current device.
class GpuPathEngine {
 public:
  template <class T> using Array = gpu::DeviceArray<T>;

  GpuPathEngine(GpuTracer& tracer, const PathScene& scene, const PathScene* cutout_scene, gpu::Allocator& allocator)
      : tracer_(tracer), levels_(scene.view.levels), cutout_scene_(cutout_scene), allocator_(allocator) {}

  template <class T> build::Result<Array<T>> array(std::uint64_t count) {
    return Array<T>::make(static_cast<std::size_t>(count), nullptr, allocator_);
  }
  template <class Stage> build::Result<void> for_each(std::uint32_t count, const PathJob& job) {
    return gpu::launch(path_kernel(Stage::kStage), std::uint64_t{count}, nullptr,
                       {.block = kPathBlock, .name = "path stage"}, job, count);
  }
  build::Result<void> trace(Query query, const Ray* rays, std::uint32_t count, Hit* hits,
                            std::uint32_t* instance_paths) {
    return tracer_.trace_on_device(query, {rays, hits, levels_ != 0 ? instance_paths : nullptr, count}, cutout_scene_);
  }
  static build::Result<PathCounts> read(const Array<PathCounts>& counts) {
    PathCounts result{};
    auto done = counts.download(std::span(&result, 1), nullptr);
    if (done) done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize", "path tracing");
    if (!done) return tl::unexpected(std::move(done.error()));
    return result;
  }
  static build::Result<void> clear(Array<PathCounts>& counts) { return counts.fill(std::byte{0}, nullptr); }

 private:
  GpuTracer& tracer_;
  std::uint32_t levels_;
  const PathScene* cutout_scene_;  ///< On the device.
  gpu::Allocator& allocator_;
};

}  // namespace

struct GpuPathTracer::State {
  State(GpuTracer& of_scene, GpuPathScene copied) : tracer(of_scene), scene(std::move(copied)) {}

  GpuTracer& tracer;
  gpu::DeviceAllocator allocator;
  GpuPathScene scene;
  gpu::DeviceArray<PathSum> sums;
  PathSums rectangle{};  ///< In `sums`.
  std::unique_ptr<GpuPathEngine> engine;
  std::unique_ptr<PathWave<GpuPathEngine>> wave;

  build::Result<void> prepare();
};

build::Result<void> GpuPathTracer::State::prepare() {
  const PathSettings& settings = scene.scene().settings;
  const auto pixels = std::size_t{settings.width} * settings.height;
  auto all = gpu::DeviceArray<PathSum>::make(pixels, nullptr, allocator);
  if (!all) return tl::unexpected(std::move(all.error()));
  sums = std::move(*all);
  rectangle = {sums.data(), 0, 0, settings.width};
  if (auto cleared = sums.fill(std::byte{0}, nullptr); !cleared) return cleared;
  engine = std::make_unique<GpuPathEngine>(tracer, scene.scene(), scene.cutout_scene(), allocator);
  auto made = PathWave<GpuPathEngine>::make(*engine, scene.scene(), kCapacity);
  if (!made) return tl::unexpected(std::move(made.error()));
  wave = std::make_unique<PathWave<GpuPathEngine>>(std::move(*made));
  return gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize", "memory of a picture");
}

build::Result<GpuPathTracer> GpuPathTracer::make(GpuTracer& tracer, const PathData& data,
                                                 const PathSettings& settings) {
  auto scene = GpuPathScene::make(tracer, data, settings);
  if (!scene) return tl::unexpected(std::move(scene.error()));
  auto state = std::make_unique<State>(tracer, std::move(*scene));
  if (auto done = state->prepare(); !done) return tl::unexpected(std::move(done.error()));
  return GpuPathTracer(std::move(state));
}

GpuPathTracer::GpuPathTracer(std::unique_ptr<State> state) : state_(std::move(state)) {}
GpuPathTracer::GpuPathTracer(GpuPathTracer&&) noexcept = default;
GpuPathTracer& GpuPathTracer::operator=(GpuPathTracer&&) noexcept = default;
GpuPathTracer::~GpuPathTracer() = default;

build::Result<void> GpuPathTracer::make_current() const { return state_->tracer.make_current(); }

std::uint32_t GpuPathTracer::capacity() const { return kCapacity; }

build::Result<void> GpuPathTracer::run(const PathBatch& batch, PathRayCounts& rays) {
  return state_->wave->run(batch, state_->rectangle, rays);
}

build::Result<void> GpuPathTracer::load(const PathBatch& rectangle, std::span<const PathSum> sums) {
  state_->rectangle = {state_->sums.data(), rectangle.left, rectangle.top, rectangle.width};
  return state_->sums.upload(sums, nullptr);
}

build::Result<void> GpuPathTracer::download(std::span<PathSum> sums) {
  auto done = state_->sums.download(sums, nullptr);
  if (done) done = gpu::check(hipStreamSynchronize(nullptr), "hipStreamSynchronize", sums.size(), " pixels");
  return done;
}

}  // namespace hiprt::tools
