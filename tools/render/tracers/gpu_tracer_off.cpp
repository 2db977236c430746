/// GpuTracer of builds without GPU code: there is never one.

#include <tools/render/tracers/gpu_tracer.h>

#include <hiprt_build/format/view.h>

namespace hiprt::tools {

struct GpuTracer::State {
  std::string device_name;
  SceneView scene;
};

build::Result<GpuTracer> GpuTracer::make(const BufferView&, const GpuTracerOptions&) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build (" HIPRT_GPU_REASON ")"});
}

GpuTracer::GpuTracer(std::unique_ptr<State> state) : state_(std::move(state)) {}
GpuTracer::GpuTracer(GpuTracer&&) noexcept = default;
GpuTracer& GpuTracer::operator=(GpuTracer&&) noexcept = default;
GpuTracer::~GpuTracer() = default;

std::vector<std::string> GpuTracer::devices() { return {}; }

build::Result<void> GpuTracer::make_current() const { return {}; }

const std::string& GpuTracer::device_name() const { return state_->device_name; }

const SceneView& GpuTracer::scene() const { return state_->scene; }

build::Result<void> GpuTracer::trace_on_device(Query, const DeviceRays&, const PathScene*) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build"});
}

build::Result<double> GpuTracer::trace(Query, const TracePolicies&, std::span<const Ray>, std::span<Hit>,
                                       const std::function<void(double)>&, std::span<std::uint32_t>, const PathScene*) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice, "no GPU code in this build"});
}

}  // namespace hiprt::tools
