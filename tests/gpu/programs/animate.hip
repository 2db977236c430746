#include <hip/hip_runtime.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_build/gpu/instances.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

using namespace hiprt;

/// The view of a frame is known on the device only.
__global__ void trace(const gpu::InstanceReport* frame, Ray ray, Hit* hit) {
  *hit = closest_hit<Instanced<Policies>>(frame->view, ray);
}

__global__ void move(gpu::DeviceInstance* instances, unsigned count, float x) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) instances[i].to_scene.row[0][3] = 2 * static_cast<float>(i) + x;
}

gpu::Result<std::vector<Hit>> animate(const BufferView& scene_file, unsigned count, unsigned frames) {
  const hipStream_t stream = nullptr;
  gpu::DeviceAllocator memory;
  const auto sizes = gpu::instance_sizes(gpu::objects_in(scene_file), count);
  if (!sizes) return tl::unexpected(sizes.error());
  auto scene = gpu::upload_scene(scene_file, stream, memory, sizes->output);
  if (!scene) return tl::unexpected(scene.error());
  auto scratch = gpu::DeviceBuffer::make(sizes->scratch, stream, memory);
  if (!scratch) return tl::unexpected(scratch.error());
  const std::vector<gpu::DeviceInstance> still(count);
  auto instances = gpu::DeviceArray<gpu::DeviceInstance>::from(still, stream, memory);
  if (!instances) return tl::unexpected(instances.error());
  auto hits = gpu::DeviceArray<Hit>::make(frames, stream, memory);
  if (!hits) return tl::unexpected(hits.error());
  const gpu::SceneObjects objects = gpu::objects_of(*scene, scene_file);
  const Ray ray{.origin = {-1, 0.25f, 0.25f}, .direction = {1, 0, 0}};
  for (unsigned frame = 0; frame < frames; ++frame) {
    auto done = gpu::launch(move, count, stream, {}, instances->data(), count, static_cast<float>(frame));
    const auto report =
        gpu::enqueue_instances(objects, {instances->data(), count}, {}, scene->buffer.data(), scratch->data(), stream);
    if (!report) return tl::unexpected(report.error());
    if (done) done = gpu::launch(trace, gpu::Grid{}, stream, {.block = 1}, *report, ray, hits->data() + frame);
    if (!done) return tl::unexpected(done.error());
  }
  return hits->to_vector(stream);
}

int main() {
  const build::Position corners[] = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const build::Triangle triangle[] = {{0, 1, 2}};
  const build::TriangleMesh mesh[] = {{corners, triangle}};
  const auto object = build::build(mesh);
  if (!object) return 1;
  const std::span<const std::byte> files[] = {object->buffer.bytes()};
  const build::Instance one[] = {{.object = 0}};
  const auto scene = build::build_instances(files, one);  // Any scene that has the objects.
  if (!scene) return 1;
  const auto hits = animate(*open_buffer(scene->buffer.bytes()), 1000, 3);
  if (!hits) return std::puts(hits.error().message.c_str());
  for (const Hit& hit : *hits) std::printf("t = %g\n", static_cast<double>(hit.t));
  return 0;
}
