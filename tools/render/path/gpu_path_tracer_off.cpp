/// GpuPathScene and GpuPathTracer of builds without GPU code: there is no GpuTracer to make them of.

#include <tools/render/path/gpu_path_scene.h>
#include <tools/render/path/gpu_path_tracer.h>

namespace hiprt::tools {

struct GpuPathScene::State {
  PathScene scene;
};

build::Result<GpuPathScene> GpuPathScene::make(GpuTracer&, const PathData&, const PathSettings&) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build"});
}

GpuPathScene::GpuPathScene(GpuPathScene&&) noexcept = default;
GpuPathScene& GpuPathScene::operator=(GpuPathScene&&) noexcept = default;
GpuPathScene::~GpuPathScene() = default;

const PathScene& GpuPathScene::scene() const { return state_->scene; }
const PathScene* GpuPathScene::cutout_scene() const { return nullptr; }

struct GpuPathTracer::State {};

build::Result<GpuPathTracer> GpuPathTracer::make(GpuTracer&, const PathData&, const PathSettings&) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build"});
}

GpuPathTracer::GpuPathTracer(GpuPathTracer&&) noexcept = default;
GpuPathTracer& GpuPathTracer::operator=(GpuPathTracer&&) noexcept = default;
GpuPathTracer::~GpuPathTracer() = default;

build::Result<void> GpuPathTracer::make_current() const { return {}; }

std::uint32_t GpuPathTracer::capacity() const { return 0; }

build::Result<void> GpuPathTracer::run(const PathBatch&, PathRayCounts&) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build"});
}

build::Result<void> GpuPathTracer::load(const PathBatch&, std::span<const PathSum>) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build"});
}

build::Result<void> GpuPathTracer::download(std::span<PathSum>) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build"});
}

}  // namespace hiprt::tools
